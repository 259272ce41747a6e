"""Figures of a finished run as the rows of a table: python -m benchmarks.figures OUT ..."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from refmesh_addon.io.report import read_report

WAYS = ("source_to_deformed", "deformed_to_source", "visible_to_source")
STATISTICS = ("mean", "p99", "max")


def main() -> None:
    """Prints a row for each output folder, and all of them as JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", nargs="+", type=Path, metavar="OUT", help="output folder of a run")
    rows = [figures(read_report(folder)) for folder in parser.parse_args().results]
    for row in rows:
        print("| " + " | ".join(formatted(value) for value in row.values()) + " |")
    print(json.dumps({"benchmark": "figures", "rows": rows}))


def figures(report: dict) -> dict[str, object]:
    """Smallest and largest of the frames, distances in % of the diagonal; of the groups; and the seconds of the whole job."""
    row: dict[str, object] = {"sequence": f"{report['sequence']['name']}, {len(report['frames'])} frames"}
    for way in WAYS:
        for figure in STATISTICS:
            values = [100 * frame[way][figure] for frame in report["frames"] if way in frame]  # bad frames have none
            row[f"{way}_{figure}"] = [min(values), max(values)]
    groups = report["groups"]
    row["triangles"] = [min(group["triangles"] for group in groups), max(group["triangles"] for group in groups)]
    row["closed"] = f"{sum(group['watertight'] and not group['self_intersections'] for group in groups)} of {len(groups)}"
    row["worst_iou"] = [min(group["iou_before"] for group in groups), min(group["iou_after"] for group in groups)]
    row["seconds"] = sum(report["seconds"].values())
    return row


def formatted(value: object) -> str:
    if isinstance(value, list):
        low, high = (formatted(item) for item in value)
        return low if low == high else f"{low} to {high}"
    return f"{value:.3g}" if isinstance(value, float) else str(value)


if __name__ == "__main__":
    main()
