"""Rate and distortion of compressed results: python -m benchmarks.compression OUT [--plot FILE.png] [--samples 40000]

OUT is the output folder of a finished run, whose sources must still be where they were, or be named by --source. Draco codes every frame by
itself; `make peers` brings it. Codecs whose packages are missing are left out, which is said. The last line is JSON.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from time import process_time

import numpy as np

from refmesh_addon.core.geometry.mesh import merged
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.discovery import find_sequence
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.ply import read_surface
from refmesh_addon.io.refmesh_stream.writer import FrameGroup
from refmesh_addon.io.report import read_report

from .compression_codecs import CODECS, FRAME_RATE, Codec, Take
from .rate_distortion import FORMULA, WAYS, MeasuredFrame, mean_saving, psnr, rate_at

BASE = "draco"
GOALS = (66.0, 68.0, 70.0, 72.0)  # dB of D2 from the source, at which rates are told
MARKS = "osd^v"


def main() -> None:
    """Codes with every codec, measures, prints the tables and one line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("output", type=Path, metavar="OUT", help="output folder of a run")
    parser.add_argument("--source", help="folder, file or pattern of the source frames (default: what the report names)")
    parser.add_argument("--samples", type=int, default=40000, help="points on each surface (default: %(default)s)")
    parser.add_argument("--codecs", nargs="+", default=list(CODECS), choices=list(CODECS), metavar="NAME")
    parser.add_argument("--plot", type=Path, help="where to draw the curves")
    arguments = parser.parse_args()
    names = [name for name in arguments.codecs if CODECS[name].is_available]
    for name in set(arguments.codecs) - set(names):
        print(f"left out: {name}, as the package {CODECS[name].package} is not installed (make peers)", file=sys.stderr)
    take = read_take(arguments.output)
    frames = read_sources(arguments.source or read_report(arguments.output)["input"], take, arguments.samples)
    rows = [{"codec": "uncoded", "setting": "", "mbps": float("nan"), **measured(take.groups, frames, take.diagonal)}]
    for name in names:
        rows += curve(name, CODECS[name], take, frames)
    savings = {name: savings_of(name, rows) for name in names}
    print(FORMULA.format(samples=arguments.samples), *table(rows), *savings_table(savings), sep="\n")
    if arguments.plot:
        draw(arguments.plot, rows)
    result = {"benchmark": "compression", "rows": rows[1:], "uncoded": rows[0] | {"mbps": None}, "savings": savings}
    print(json.dumps(result | {"input": str(arguments.output)}))


def read_take(output: Path) -> Take:
    """The deformed frames of a run, in groups of one topology."""
    report, groups = read_report(output), []
    paths = {frame["number"]: output / frame["deformed"] for frame in report["frames"]}
    for group in report["groups"]:
        meshes = [read_surface(paths[number]) for number in group["frames"]]
        groups.append(FrameGroup(tuple(group["frames"]), np.stack([mesh.vertices for mesh in meshes]), meshes[0].triangles))
    return Take(groups, report["bbox_diagonal"])


def read_sources(source: str, take: Take, samples: int) -> dict[int, MeasuredFrame]:
    """The source frames by their numbers."""
    numbers = {number for group in take.groups for number in group.numbers}
    files = {frame.number: frame.path for frame in find_sequence(source).frames if frame.number in numbers}
    return {number: MeasuredFrame(merged(read_mesh(path))[0], samples, number) for number, path in files.items()}


def curve(name: str, codec: Codec, take: Take, frames: dict[int, MeasuredFrame]) -> list[dict]:
    """A row for each setting of a codec."""
    rows, count = [], sum(len(group.numbers) for group in take.groups)
    for setting in codec.settings:
        start = process_time()
        size, decoded = codec.run(take, setting)
        seconds = (process_time() - start) / count
        rate = 8e-6 * size * FRAME_RATE / count
        row = {"codec": name, "setting": codec.describe(setting), "mbps": rate, "bytes": size, "seconds": seconds}
        rows.append(row | measured(decoded, frames, take.diagonal))
        print("\t".join(table_row(rows[-1])), flush=True)
    return rows


def measured(groups: list[FrameGroup], frames: dict[int, MeasuredFrame], diagonal: float) -> dict[str, float]:
    """PSNR of all frames, each way, D1 and D2; and the mean of TVMC's measure."""
    pairs = [(frames[n], TriangleMesh(p, group.triangles)) for group in groups for n, p in zip(group.numbers, group.positions)]
    every = [frame.squares(decoded) for frame, decoded in pairs]
    result = {}
    for way in WAYS:
        for index, kind in enumerate(("d1", "d2")):
            result[f"{way}_{kind}"] = psnr(float(np.mean([getattr(squares, way)[index] for squares in every])), diagonal)
    return result | {"tvmc": float(np.mean([squares.tvmc for squares in every]))}


def savings_of(name: str, rows: list[dict], key: str = "source_to_decoded_d2") -> dict[str, float | None]:
    """BD-rate against the base, and the rates at the goals, as shares of the base's."""
    own, base = ([row for row in rows if row["codec"] == codec] for codec in (name, BASE))
    result: dict[str, float | None] = {}
    rates, quality = [row["mbps"] for row in own], [row[key] for row in own]
    if base and name != BASE:
        result["bd_rate"] = mean_saving(rates, quality, [row["mbps"] for row in base], [row[key] for row in base])
    for goal in GOALS:
        result[f"mbps_at_{goal:g}"] = rate_at(rates, quality, goal)
    return result


COLUMNS = ("mbps", *(f"{way}_{kind}" for way in WAYS for kind in ("d1", "d2")), "tvmc", "seconds")


def table(rows: list[dict]) -> list[str]:
    """Lines of a table in Markdown."""
    head = ["codec", "setting", "Mbps", *(f"{way.replace('_', ' ')}, {kind}" for way in WAYS for kind in ("D1", "D2")), "TVMC", "s / frame"]
    return ["", f"| {' | '.join(head)} |", "|---" * len(head) + "|", *(f"| {' | '.join(table_row(row))} |" for row in rows)]


def table_row(row: dict) -> list[str]:
    return [row["codec"], row["setting"], *("" if np.isnan(row.get(name, np.nan)) else f"{row[name]:.2f}" for name in COLUMNS)]


def savings_table(savings: dict[str, dict]) -> list[str]:
    head = ["codec", "BD-rate against Draco", *(f"Mbps at {goal:g} dB" for goal in GOALS)]
    lines = ["", f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for name, saving in savings.items():
        share = saving.get("bd_rate")
        rates = ["" if saving[f"mbps_at_{goal:g}"] is None else f"{saving[f'mbps_at_{goal:g}']:.2f}" for goal in GOALS]
        lines.append(f"| {name} | {'' if share is None else f'{100 * share:.0f} %'} | {' | '.join(rates)} |")
    return lines


def draw(path: Path, rows: list[dict]) -> None:
    """Distortion over rate: solid from the source, dashed over what is visible."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(8, 5), constrained_layout=True)
    for index, name in enumerate(dict.fromkeys(row["codec"] for row in rows[1:])):
        own = [row for row in rows if row["codec"] == name]
        for way, line in zip(WAYS, ("-", "--")):
            label = f"{name}, {way.replace('_', ' ')}"
            points = [row["mbps"] for row in own], [row[f"{way}_d2"] for row in own]
            axes.plot(*points, line, marker=MARKS[index % len(MARKS)], color=f"C{index}", label=label)
    axes.axhline(rows[0]["source_to_decoded_d2"], color="gray", linewidth=0.8, label="uncoded, source to decoded")
    axes.set(xscale="log", xlabel="Mbps at 30 frames per second", ylabel="D2 PSNR, dB")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend(fontsize=8)
    figure.savefig(path, dpi=130)


if __name__ == "__main__":
    main()
