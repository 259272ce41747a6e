"""Bodies seen by one virtual depth camera against the same bodies seen all round: distances, and whether vertices stay on the skin.

    python -m benchmarks.one_camera [--cases tumble grasp walk] [--frames 10] [--set name=value]

Distances are from all that was kept of a frame, and from what it shows. Drift is that of `benchmarks.drift`, of the vertices that the
frame and the anchor frame of its group both show; of each body as well, as the outline of a ball does not show that it turns.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

from refmesh_addon.core.evaluation.shown_surface import SHOWN
from refmesh_addon.core.settings import Settings
from refmesh_addon.io.ply import read_visibility
from refmesh_addon.io.report import read_report
from refmesh_addon.pipeline.run import run
from refmesh_addon.pipeline.session.job import JobSpec

from .drift import takes
from .frames import frames_folder, one_camera_folder
from .generated_takes import run_takes
from .trajectories import CASES, Case


def finished(source: Path, count: int, settings: Settings, output: str) -> dict:
    """Runs a job on the first frames of a folder and gives its report."""
    job = JobSpec(str(source), output, frames=f"1-{count}", settings=settings, until="evaluation")
    run(job, lambda *_: None, lambda line: print(line, file=sys.stderr))
    return read_report(output)


def visible_drift(case: Case, output: Path, report: dict) -> tuple[np.ndarray, np.ndarray]:
    """(N,) distances in edge lengths from where vertices truly went, of all frames together, and (N,) the body of each."""
    drift, bodies = [], []
    for group, take in zip(report["groups"], takes(case, output), strict=True):
        frames = [frame for frame in report["frames"] if frame["group"] == group["index"]]
        shown = np.stack([read_visibility(output / frame["deformed"]) >= SHOWN for frame in frames])
        both = np.delete(shown & shown[take.anchor], take.anchor, axis=0)
        own = case.bodies_of(take.vertices[take.anchor], case.times[take.indices[take.anchor]])
        drift.append(take.drift[both])
        bodies.append(np.broadcast_to(own, both.shape)[both])
    return np.concatenate(drift), np.concatenate(bodies)


def measured(name: str, counts: tuple[int, int], settings: Settings, cache: Path) -> dict[str, float]:
    """Runs one case in both ways.  counts : frames taken, and frames of the whole sequence."""
    count, whole = counts
    mean = lambda report, key: np.mean([frame[key]["mean"] for frame in report["frames"]])
    with tempfile.TemporaryDirectory() as all_round, tempfile.TemporaryDirectory() as output:
        full = finished(frames_folder(CASES[name][0], whole, cache), count, settings, all_round)
        seen = finished(one_camera_folder(CASES[name][0], whole, cache), count, settings, output)
        drift, bodies = visible_drift(Case.named(name, whole, cache), Path(output), seen)
    frames = seen["frames"]
    result = {
        "all_round_mean": mean(full, "source_to_deformed"),
        "mean": mean(seen, "source_to_deformed"),
        "visible_mean": mean(seen, "visible_to_source"),
        "visible_max": max(frame["visible_to_source"]["max"] for frame in frames),
        "border_mean": np.mean([frame["border"]["mean"] for frame in frames]),
        "kept": np.mean([frame["kept"] for frame in frames]),
        "unseen": np.mean([frame["unseen"] for frame in frames]),
        "drift_median": np.median(drift),
        "drift_p95": np.quantile(drift, 0.95),
        "meshes": len(seen["groups"]),
    }
    several = np.unique(bodies) if len(np.unique(bodies)) > 1 else ()
    result |= {f"drift_median_body_{body}": np.median(drift[bodies == body]) for body in several}
    result["ratio"] = result["mean"] / result["all_round_mean"]
    return {key: round(float(value), 6) for key, value in result.items()}


def main() -> None:
    """Runs every case, prints a table and then one line of JSON."""
    run_takes("one_camera", __doc__, ("tumble", "grasp", "walk"), measured)


if __name__ == "__main__":
    main()
