"""A segment as it could be written: one reduced mesh, and morph targets for runs of frames that are short enough for a few of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...core.compression.morph_targets import Courses, MorphTargets, fitted_morph_targets, packed_bits
from ...core.compression.reduction import reduced
from ...core.errors import RefMeshError
from ..refmesh_stream.writer import FrameGroup
from .choice import SmallGlb
from .triangle_order import packing_order

ENOUGH = 0.5  # of the error: where fewer triangles use up less, more of them save nothing
LEAST_LEFT = 0.3  # of the error is for morph targets, whatever reducing triangles uses up
TRIANGLE_BITS = 9  # that a triangle takes about
GREATEST = (1 << 16) - 1  # whole number of a position
SLACK = 1e-6  # of the error, for rounding


@dataclass(frozen=True)
class Run:
    """Consecutive frames with the same morph targets.  rows : of these frames in the segment.  error : RMS, scene units."""

    rows: slice
    model: MorphTargets
    error: float


@dataclass(frozen=True)
class Segment:
    """numbers : of the F frames.  frames : (F, V, 3) that the models stand for.  triangles : (T, 3), in the order in which they pack."""

    numbers: tuple[int, ...]
    frames: np.ndarray
    triangles: np.ndarray
    runs: tuple[Run, ...]

    @property
    def error(self) -> float:
        """Of the worst run: RMS, scene units."""
        return max(run.error for run in self.runs)

    @property
    def middle(self) -> int:
        """Row of the frame in which colors are transferred."""
        return len(self.numbers) // 2

    def rank(self, error: float) -> tuple[float, float]:
        """Low is better: first to be close enough, then to be small."""
        bits = sum(packed_bits(run.model) for run in self.runs)
        return max(self.error, (1 + SLACK) * error), bits + TRIANGLE_BITS * len(self.triangles)


def fitted_segment(group: FrameGroup, choice: SmallGlb, diagonal: float) -> Segment:
    """The smallest of those that are close enough, else the closest.

    diagonal : of the bounding box of the whole sequence, scene units. Raises RefMeshError where the error needs more than 16 bits.
    """
    error = choice.error * diagonal
    return min(_candidates(group, choice, error), key=lambda candidate: candidate.rank(error))


def _candidates(group: FrameGroup, choice: SmallGlb, error: float) -> Iterator[Segment]:
    """One for each number of triangles, up to the first that leaves most of the error to morph targets."""
    for count in choice.triangles:
        reduction = reduced(group.positions, group.triangles, count)
        triangles, order = packing_order(reduction.triangles, reduction.frames.shape[1])
        frames = reduction.frames[:, order]
        left = float(np.sqrt(max(error**2 - reduction.error**2, (LEAST_LEFT * error) ** 2)))
        runs = [
            Run(rows, model, float(np.hypot(reduction.error, model.error)))
            for rows, model in fitted_runs(frames, triangles, left, choice.targets)
        ]
        _check(group, runs)
        yield Segment(group.numbers, frames, triangles, tuple(runs))
        if reduction.error < ENOUGH * error:
            break


def fitted_runs(
    frames: np.ndarray, triangles: np.ndarray, error: float, targets: tuple[int, int]
) -> Iterator[tuple[slice, MorphTargets]]:
    """Rows of the (F, V, 3) frames, in order, and their morph targets.  error : RMS along normals, scene units."""
    return _runs(frames, triangles, error, targets, slice(0, len(frames)))


def _runs(
    frames: np.ndarray, triangles: np.ndarray, error: float, targets: tuple[int, int], rows: slice
) -> Iterator[tuple[slice, MorphTargets]]:
    """The frames as a whole where their morph targets are close enough, else in halves."""
    fewest, most = targets
    courses, is_short = Courses.of(frames[rows], triangles), rows.stop - rows.start <= most
    if is_short or courses.error(courses.cut(most)) <= error:  # else nothing needs to be rounded to know that it is too coarse
        model = fitted_morph_targets(courses, error, range(fewest, most + 1))
        if is_short or model.error <= error:
            yield rows, model
            return
    middle = (rows.start + rows.stop) // 2
    for half in (slice(rows.start, middle), slice(middle, rows.stop)):
        yield from _runs(frames, triangles, error, targets, half)


def _check(group: FrameGroup, runs: list[Run]) -> None:
    models = [run.model for run in runs]
    if max(max(model.base.max(initial=0), 2 * np.abs(model.targets).max(initial=0)) for model in models) > GREATEST:
        frames = f"frames {group.numbers[0]} to {group.numbers[-1]}"
        raise RefMeshError(f"{frames}: an error that small needs more than 16 bits; allow a larger one")
