"""The reference mesh of a group of frames of an open take: what its frames show together."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...core.reference.cap_points import OrientedPoints
from ...core.reference.group import ReferenceMesh
from ...core.reference.open_reference import build_open_reference
from ...core.reference.union_points import PointUnion, UnionPoints, without_inner_rims
from ..session.context import Context
from .reconstruction import RECONSTRUCTIONS

# Frames that share the points of a reconstruction, at most: what only a few of many frames show needs points too.
MOST_SHARING = 8


def anchor_penalty(context: Context, frames: tuple[int, ...]) -> np.ndarray:
    """(F,) what speaks against each frame as the anchor frame: ragged rims of holes, or of open takes, which are all rim, other frames
    far off in time, as centers slide along a sheet by and by.
    """
    if context.frames.take is not None:
        return np.abs(np.array(frames) - np.mean(frames))
    return np.array([context.frames.statistics[frame].rim_excess for frame in frames])


def union_of(frames: Iterable[OrientedPoints], cell: float) -> UnionPoints:
    """What frames in reference positions show together, read one after the other.  cell : in which points are averaged, scene units."""
    union = PointUnion(cell)
    for frame in frames:
        union.add(frame.points, frame.normals, ~frame.on_cap)
    return without_inner_rims(union.points())


def build_open_with(name: str, union: UnionPoints, spacing: float, triangles: int, depth: int, is_open: bool) -> ReferenceMesh:
    """`build_open_reference` by one of RECONSTRUCTIONS."""
    return build_open_reference(union, spacing, triangles, depth, RECONSTRUCTIONS[name], is_open)
