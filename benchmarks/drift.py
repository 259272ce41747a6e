"""Whether vertices stay on their spot of the skin: the whole job on sequences whose true motion is known.

    python -m benchmarks.drift [--cases beam clasp] [--frames 10] [--group-size 5] [--set name=value]

A vertex belongs to the place of the body where it lies in the anchor frame of its group; in the other frames it is compared
with the closed-form motion of that place.
"""

from __future__ import annotations

import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.geometry.mesh import mean_edge_length, sample_surface
from refmesh_addon.core.settings import Settings
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.report import read_report
from refmesh_addon.pipeline.run import run
from refmesh_addon.pipeline.session.job import JobSpec

from .frames import frames_folder
from .generated_takes import run_takes
from .trajectories import CASES, Case

SAMPLES = 20_000  # on a surface, of its distance from its source
SEEN = ("tumble", "beam", "clasp")  # whose outline shows how they move, so that the true motion can be known at all


@dataclass(frozen=True)
class Take:
    """One group's frames.

    indices : of its frames.  vertices : (F, R, 3).  truth : (F, R, 3) where the places of the anchor frame went.
    triangles : (S, 3).  anchor : position in the group.  length : mean edge length.
    """

    indices: np.ndarray
    vertices: np.ndarray
    truth: np.ndarray
    triangles: np.ndarray
    anchor: int
    length: float

    @property
    def drift(self) -> np.ndarray:
        """(F - 1, R) distances from the true places in all frames but the anchor, in mean edge lengths."""
        return np.delete(np.linalg.norm(self.vertices - self.truth, axis=2), self.anchor, axis=0) / self.length

    def mesh(self, position: int) -> TriangleMesh:
        return TriangleMesh(self.vertices[position], self.triangles)


def takes(case: Case, output: Path) -> list[Take]:
    """The groups of a finished run, each beside its truth."""
    report, takes = read_report(output), []
    for group in report["groups"]:
        meshes = [read_mesh(output / frame["deformed"]) for frame in report["frames"] if frame["group"] == group["index"]]
        indices = np.array(group["frames"]) - 1
        anchor = int(np.abs(indices + 1 - group["anchor"]).argmin())  # or next to it, where a group between has a mesh of its own
        vertices = np.stack([mesh.vertices for mesh in meshes])
        truth = moved(case, vertices[anchor], indices[anchor], indices)
        takes.append(Take(indices, vertices, truth, meshes[0].triangles, anchor, mean_edge_length(meshes[anchor])))
    return takes


def moved(case: Case, points: np.ndarray, start: int, frames: np.ndarray) -> np.ndarray:
    """(F, N, 3) where (N, 3) points of one frame truly are in others."""
    bodies = case.bodies_of(points, case.times[start])
    rest = case.sequence.rest(points, bodies, case.times[start])
    return np.stack([case.sequence.motion(rest, bodies, case.times[frame]) for frame in frames])


def figures(case: Case, takes: list[Take], centers: np.ndarray) -> dict[str, float]:
    """Drift in edge lengths, accelerations as ratios, and what happens at the boundaries of groups.

    centers : (F, C, 3) of all frames.
    """
    drift = np.concatenate([take.drift.ravel() for take in takes])
    long = [take for take in takes if len(take.indices) > 2]
    inner = {"vertices": [take.vertices for take in long], "truth": [take.truth for take in long]}
    inner["centers"] = [centers[take.indices] for take in long]
    pace = {name: np.mean([acceleration(positions) for positions in values]) for name, values in inner.items()}
    jumps, errors, captured = np.array([boundary(case, *pair) for pair in zip(takes, takes[1:])]).reshape(-1, 3).sum(axis=0)
    return {
        "median": np.median(drift),
        "p95": np.quantile(drift, 0.95),
        "acceleration_ratio": pace["vertices"] / pace["centers"],
        "true_acceleration_ratio": pace["truth"] / pace["centers"],
        "jump_ratio": jumps / errors if errors else 0.0,
        "captured_jump_ratio": captured / errors if errors else 0.0,
    }


def acceleration(positions: np.ndarray) -> float:
    """Mean length of the second differences of (F, N, 3) positions in time."""
    return float(np.linalg.norm(np.diff(positions, 2, axis=0), axis=2).mean())


def boundary(case: Case, last: Take, first: Take) -> tuple[float, float, float]:
    """How far one group's vertices, truly moved on by a frame, lie from the next group's surface; what both surfaces miss their sources
    by, summed; and how far the sources themselves lie apart like that: each is another set of flat triangles for one round body.
    """
    before, after = last.indices[-1], first.indices[0]
    ahead = lambda points: moved(case, points, before, np.array([after]))[0]
    ends, sources = (last.mesh(-1), first.mesh(0)), (case.meshes[before], case.meshes[after])
    errors = [distance(source, sample_surface(mesh, SAMPLES, np.random.default_rng(0))[0]) for source, mesh in zip(sources, ends)]
    return distance(ends[1], ahead(ends[0].vertices)), sum(errors), distance(sources[1], ahead(sources[0].vertices))


def distance(surface: TriangleMesh, points: np.ndarray) -> float:
    return float(SurfaceIndex(surface).query(points).distances.mean())


def measured(name: str, counts: tuple[int, int], settings: Settings, cache: Path) -> dict[str, float]:
    """Runs one case and judges it.  counts : frames taken, and frames of the whole sequence."""
    count, whole = counts
    case, began = Case.named(name, whole, cache), time.perf_counter()
    with tempfile.TemporaryDirectory() as output:
        source = frames_folder(CASES[name][0], whole, cache)
        job = JobSpec(str(source), output, frames=f"1-{count}", settings=settings)
        run(job, lambda *_: None, lambda line: print(line, file=sys.stderr))
        seconds, report = time.perf_counter() - began, read_report(output)
        centers = np.load(Path(output) / "centers.npz")["positions"]
        result = figures(case, takes(case, Path(output)), centers)
    result["mean_distance"] = np.mean([frame["deformed_to_source"]["mean"] for frame in report["frames"]])
    result["flipped"] = max(frame["flipped"] for frame in report["frames"])
    return {key: round(float(value), 6) for key, value in result.items()} | {"seconds": round(seconds, 1)}


def main() -> None:
    """Runs every case, prints a table and then one line of JSON."""
    run_takes("drift", __doc__, SEEN, measured)


if __name__ == "__main__":
    main()
