"""The limits of a segment: what its mesh must not do worse in a frame than a mesh made for that frame's group alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry.mesh import triangle_areas
from ..geometry.stretch import RestShape
from ..types import FrozenArrays, TriangleMesh
from .metrics import source_distances
from .shown_surface import SHOWN, shown_vertices

# A mesh of the whole segment may be this many times as far from the source as the group's own, in the mean and at the 99th percentile:
# seen side by side, distances that differ by less look the same.
MEAN_RATIO, P99_RATIO = 1.5, 2.0
P99_RATIO_VIEW = 1.5  # of open takes, in which flips and stretch do not count
# Distances below these, in shares of the diagonal, are never too far: a pixel in a picture 2000 pixels high is larger.
MEAN_FLOOR, P99_FLOOR = 1e-4, 8e-4
FLIPPED_MORE = 5e-4  # share of the triangles that may be flipped beyond what the group's own mesh has
OVERSTRETCHED_MORE = 0.01  # share of the surface that may be over-stretched beyond that
# Of open takes, the share of the mesh that a frame does not show may be larger by this. What a camera sees of a body that turns by a few
# dozen degrees is less; beyond that, limbs that were followed through an occlusion in vain are there twice.
UNSEEN_MORE = 0.15


@dataclass(frozen=True)
class FrameFigures(FrozenArrays):
    """How well a mesh serves one frame.

    mean, p99 : distance from source to deformed mesh, shares of the diagonal.  flipped : share of the triangles.
    overstretched : share of the surface, as `RestShape` gives it.  unseen : share of the mesh that the frame of an open take does not show.
    """

    mean: float
    p99: float
    flipped: float
    overstretched: float
    unseen: float = 0.0


USUAL = FrameFigures(mean=1e-4, p99=6e-4, flipped=0.0, overstretched=0.0, unseen=0.3)


def frame_figures(rest: TriangleMesh, vertices: np.ndarray, flipped: float, source: TriangleMesh, samples: int) -> FrameFigures:
    """The figures of one frame.

    rest : the reference mesh.  vertices : (R, 3) where it is deformed to.  source : what it was fitted to.
    samples : points on the source, of which the distances are; shares of its diagonal.
    """
    distances = source_distances(source, rest.moved(vertices), samples)
    return FrameFigures(distances.mean, distances.p99, flipped, RestShape(rest).overstretched(vertices))


def passed_limits(frame: FrameFigures, own: FrameFigures) -> list[str]:
    """The limits that the segment's mesh passes in a frame, in words with both figures; none where it serves the frame.

    own : figures of a mesh made for the frame's group alone.
    """
    rows = [
        ("mean distance", frame.mean, own.mean, 3),
        ("99th percentile of the distance", frame.p99, own.p99, 3),
        ("flipped triangles", frame.flipped, own.flipped, 2),
        ("over-stretched surface", frame.overstretched, own.overstretched, 1),
        ("surface out of view", frame.unseen, own.unseen, 0),
    ]
    pairs = zip(rows, _limits(own), strict=True)
    return [f"{name} {value:.{digits}%} against {other:.{digits}%}" for (name, value, other, digits), limit in pairs if value > limit]


def excess(frame: FrameFigures, own: FrameFigures) -> float:
    """The largest of a frame's figures as a multiple of its limit; above 1 where one is passed. Arguments as of `passed_limits`."""
    return max(value / limit for value, limit in zip(vars(frame).values(), _limits(own), strict=True))


def _limits(own: FrameFigures) -> tuple[float, ...]:
    """Of each of the figures."""
    p99_ratio = P99_RATIO_VIEW if own.unseen else P99_RATIO
    distances = max(MEAN_RATIO * own.mean, MEAN_FLOOR), max(p99_ratio * own.p99, P99_FLOOR)
    return (*distances, own.flipped + FLIPPED_MORE, own.overstretched + OVERSTRETCHED_MORE, own.unseen + UNSEEN_MORE)


def unseen_share(deformed: TriangleMesh, source: TriangleMesh) -> float:
    """Share of the area of a deformed mesh that a frame of an open take does not show.  source : what was kept of the frame."""
    shown, areas = (shown_vertices(deformed, source).visibility >= SHOWN)[deformed.triangles].all(axis=1), triangle_areas(deformed)
    return float(1.0 - areas[shown].sum() / areas.sum())


def usual_figures(frames: Sequence[FrameFigures]) -> FrameFigures:
    """What most frames reach, but no worse than a mesh of a group reaches on captures of all kinds: all frames may be bad."""
    return FrameFigures(*(min(float(np.median([getattr(one, name) for one in frames])), most) for name, most in vars(USUAL).items()))


def worse_of(first: FrameFigures, second: FrameFigures) -> FrameFigures:
    """The larger of each of two figures."""
    return FrameFigures(*(max(getattr(first, name), value) for name, value in vars(second).items()))
