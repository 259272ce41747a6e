"""Tracking where the true motion is known: how far centers stray, and whether they stay in their bodies.

    python -m benchmarks.trajectories [--cases grasp collide] [--set name=value] [--repeat]

A center belongs to the body that it lies in on the first frame, and is judged by the closed-form motion of the place it
has there, on every frame on which that place exists. Lengths are in center spacings s.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from refmesh_addon.core.settings import TrackingSettings
from refmesh_addon.core.tracking.forward import TrackedFrame
from refmesh_addon.core.tracking.lloyd import Cells
from refmesh_addon.core.tracking.volume import Volume
from refmesh_addon.core.types import TriangleMesh
from sample_scenes.generators import SEQUENCES, Sequence

from .common import add_tracking_options, read_bodies, tracked, tracking_settings
from .frames import CACHE, frames_folder

CASES = {name: (name, False) for name in SEQUENCES} | {"leave": ("appear", True)}  # sequence, and whether it is played backwards
LOST = 0.5  # a center this far outside every body, in s, is lost
# The change of place and scale that --repeat tries.
SCALE, TURN, SHIFT = 10.0, Rotation.from_rotvec([0.4, -0.7, 0.5]).as_matrix(), np.array([30.0, -50.0, 20.0])


@dataclass(frozen=True)
class Case:
    """A synthetic sequence, the time of each frame, and the frames."""

    sequence: Sequence
    times: np.ndarray
    meshes: list[TriangleMesh]

    @classmethod
    def named(cls, name: str, count: int, cache: Path) -> Case:
        sequence, backwards = CASES[name]
        order = slice(None, None, -1 if backwards else 1)
        return cls(SEQUENCES[sequence](), np.linspace(0.0, 1.0, count)[order], read_bodies(frames_folder(sequence, count, cache))[order])

    def there(self, time: float) -> np.ndarray:
        """(B,) which bodies exist at that time."""
        return np.array([body.start <= time for body in self.sequence.bodies])

    def depths(self, points: np.ndarray, time: float) -> np.ndarray:
        """Signed distance (B, N) of points from each body, negative inside; infinite from one that does not exist."""
        absent = np.full(len(points), np.inf)
        return np.array([body.distance(points, time) if body.start <= time else absent for body in self.sequence.bodies])

    def bodies_of(self, points: np.ndarray, time: float) -> np.ndarray:
        """Number (N,) of the body that each point lies deepest in, or nearest to."""
        return self.depths(points, time).argmin(axis=0)


@dataclass(frozen=True)
class Judgement:
    """errors : (F, C) in s.  wrong : (F, C) out of its own body and in or nearer to another.  judged : (F, C) where the true place exists.

    own : (C,) the body of each center.  late : numbers of the bodies that are there at the end and were not at first.
    """

    errors: np.ndarray
    wrong: np.ndarray
    judged: np.ndarray
    own: np.ndarray
    late: np.ndarray


def judge(case: Case, positions: np.ndarray, spacing: float) -> Judgement:
    """Compares (F, C, 3) tracked positions with the true motion.

    Centers that a body drew in which came later are judged up to its coming only: nothing says which ones had to go.
    """
    sequence, times = case.sequence, case.times
    own = case.bodies_of(positions[0], times[0])
    rest = sequence.rest(positions[0], own, times[0])
    late = np.flatnonzero(case.there(times[-1]) & ~case.there(times[0]))
    drawn = np.isin(case.bodies_of(positions[-1], times[-1]), late)
    errors, wrong, judged = (np.empty(positions.shape[:2], dtype) for dtype in (float, bool, bool))
    for index, (points, when) in enumerate(zip(positions, times)):
        errors[index] = np.linalg.norm(points - sequence.motion(rest, own, when), axis=1) / spacing
        depths, there = case.depths(points, when), case.there(when)
        # Bodies that press on each other overlap a little: a point there is in its own body, however deep in the other.
        wrong[index] = (depths.argmin(axis=0) != own) & (depths[own, np.arange(len(own))] > 0)
        judged[index] = there[own] & ~(drawn & there[late].any()) & np.isfinite(points).all(axis=1)
    return Judgement(errors, wrong & judged, judged, own, late)


def figures(case: Case, states: list[TrackedFrame], last: Volume, seconds: float) -> dict[str, float]:
    """What is reported of one case."""
    spacing, first = states[0].affinity.spacing, len(states[0].centers)  # those that are born later are judged by their number
    positions, active_centers = (np.stack([getattr(state, name)[:first] for state in states]) for name in ("centers", "active_centers"))
    judgement = judge(case, positions, spacing)
    judgement = replace(judgement, wrong=judgement.wrong & active_centers, judged=judgement.judged & active_centers)
    errors, dfu = judgement.errors[judgement.judged], [state.dfu for state in states]
    wrong = judgement.wrong.sum(axis=1) / np.maximum(judgement.judged.sum(axis=1), 1)
    end = states[-1].centers[states[-1].active_centers]
    inside = case.depths(end, case.times[-1]).min(axis=0) < LOST * spacing
    result = {
        "median": np.median(errors),
        "p95": np.quantile(errors, 0.95),
        "end_median": np.median(judgement.errors[-1][judgement.judged[-1]]),
        **_of_bodies(judgement),
        "wrong_end": wrong[-1],
        "wrong_worst": wrong.max(),
        "dfu_mean": np.mean(dfu),
        "dfu_end": dfu[-1],
        "lost": np.count_nonzero(~inside),
        "not_finite": np.count_nonzero(~np.isfinite(positions).all(axis=2)),
        "judged": judgement.judged.mean(),
        "steps": np.mean([state.steps for state in states[1:]]),
        "seconds": seconds,
    }
    if len(judgement.late):
        in_late = lambda points: np.isin(case.bodies_of(points, case.times[-1]), judgement.late)
        result["late_centers"] = in_late(end).mean()
        result["late_volume"] = np.average(in_late(last.finest.positions), weights=last.finest.masses)
    return {name: round(float(value), 5) for name, value in result.items()}


def _of_bodies(judgement: Judgement) -> dict[str, float]:
    """Median and 95th percentile of each body that had centers at first, where there are several."""
    bodies, result = np.unique(judgement.own), {}
    for body in bodies if len(bodies) > 1 else ():
        errors = judgement.errors[judgement.judged & (judgement.own == body)]
        result |= {f"body_{body}_median": np.median(errors), f"body_{body}_p95": np.quantile(errors, 0.95)}
    return result


def measured(case: Case, settings: TrackingSettings, repeat: bool) -> dict[str, float]:
    """Tracks one case and judges it; `repeat` tracks it again in another place and scale."""
    began = time.perf_counter()
    states, volumes = zip(*tracked(case.meshes, settings))
    result = figures(case, states, volumes[-1], time.perf_counter() - began)
    return result | (repeated(case, settings, states, volumes[0].voxel) if repeat else {})


def repeated(case: Case, settings: TrackingSettings, states: list[TrackedFrame], voxel: float) -> dict[str, float]:
    """How far, in voxels, centers end from where they should when the input is scaled, turned and moved.

    The second run starts from the first one's centers: other voxels would spread others, as good but not the same.
    """
    change = lambda points: SCALE * points @ TURN.T + SHIFT
    first, count = states[0], len(states[0].centers)
    start = replace(
        first,
        centers=change(first.centers),
        before=change(first.before),
        affinity=replace(first.affinity, spacing=SCALE * first.affinity.spacing),
        cells=_changed(first.cells, change),
    )
    again = [state.centers for state, _ in tracked([mesh.moved(change(mesh.vertices)) for mesh in case.meshes], settings, start)]
    pairs = [(centers[:count], change(state.centers[:count])) for centers, state in zip(again, states)]
    apart = np.stack([np.linalg.norm(centers - expected, axis=1) for centers, expected in pairs]) / (SCALE * voxel)
    shares = {"repeat_median": 0.5, "repeat_p95": 0.95, "repeat_max": 1.0}
    return {name: round(float(np.quantile(apart, share)), 3) for name, share in shares.items()}


def _changed(cells: Cells, change: Callable[[np.ndarray], np.ndarray]) -> Cells:
    second = SCALE**2 * TURN @ cells.second @ TURN.T
    return Cells(cells.masses, change(cells.centroids), second, SCALE**2 * cells.energy)


def main() -> None:
    """Tracks every case, prints a table and then one line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", nargs="+", default=list(CASES), choices=CASES, metavar="CASE", help=f"of {', '.join(CASES)}")
    parser.add_argument("--frames", type=int, default=30, help="frames from time 0 to 1 (default: %(default)s)")
    parser.add_argument("--repeat", action="store_true", help="also track each case scaled, turned and moved")
    parser.add_argument("--cache", type=Path, default=CACHE, help="folder for generated frames")
    add_tracking_options(parser, 128)
    arguments = parser.parse_args()
    if arguments.frames < 2:
        parser.error("give at least two frames")
    settings, results = tracking_settings(arguments), {}
    for name in arguments.cases:
        results[name] = measured(Case.named(name, arguments.frames, arguments.cache), settings, arguments.repeat)
        print(f"{name:8}", *(f"{key} {value:g}" for key, value in results[name].items()), sep="  ", flush=True)
    print(json.dumps({"benchmark": "trajectories", "frames": arguments.frames, "settings": vars(settings), "cases": results}))


if __name__ == "__main__":
    main()
