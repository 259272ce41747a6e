"""Bodies that must be separate, among the tracked centers: those that the user marked, and those that only their motion shows apart."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ...core.errors import RefMeshError
from ...core.geometry.mesh import vertex_components
from ...core.reference.marked_bodies import bodies_by_marks
from ...core.reference.marks import Marks, parse_marks
from ...core.types import TriangleMesh
from ...io.frame_range import format_ranges
from ..session.context import Context
from .tracking_result import TrackingResult

JOINED = 0.05  # least share of a piece of surface that has to belong to a second body, so that a ragged edge does not count


def parsed_marks(context: Context) -> Marks | None:
    """What `--apart` asks for, if anything. Raises RefMeshError when it cannot be parsed or names a frame that is not there."""
    marks = parse_marks(context.settings.reference.apart)
    if marks and marks.frame not in context.numbers:
        there = format_ranges(context.numbers) + context.left_out.advice(marks.frame)
        raise RefMeshError(f"--apart: bodies are marked in frame {marks.frame}, which is not part of the job; mark them in one of {there}")
    return marks


def bodies_apart(context: Context, tracking: TrackingResult) -> np.ndarray | None:
    """(C,) the body of each center, -1 where marks reach none; None when no bodies are to be apart.

    Raises RefMeshError for marks that lie outside the volume or contradict each other.
    """
    marks = parsed_marks(context)
    if marks is None:
        return tracking.moving
    if len(marks.bodies) < 2:
        context.warn("only one body is marked: mark another one that it is to be apart from")
        return tracking.moving
    if context.settings.reference.mapping == "rbf":
        context.warn("--mapping rbf cannot tear, so marked bodies stay together: choose --mapping affinity")
    spacing = tracking.range_of(context.numbers.index(marks.frame)).spacing
    try:
        marked = bodies_by_marks(tracking.positions, context.numbers, spacing, marks)
    except ValueError as error:
        raise RefMeshError(f"--apart, frame {marks.frame}: {error}; mark the bodies again") from error
    return marked if tracking.moving is None else _divided_further(marked, tracking.moving)


def _divided_further(marked: np.ndarray, moving: np.ndarray) -> np.ndarray:
    """(C,) marked bodies, -1 for none, each divided where motion shows several."""
    known, result = marked >= 0, marked.copy()
    result[known] = np.unique(np.stack([marked, moving])[:, known], axis=1, return_inverse=True)[1].ravel()
    return result


def joined_bodies(mesh: TriangleMesh, centers: np.ndarray, bodies: np.ndarray) -> list[int]:
    """Numbers of the marked bodies that a reference mesh still shows in one piece with another. centers : (C, 3) reference centers."""
    count, piece = vertex_components(mesh)
    kinds = bodies.max() + 1
    owners = bodies[cKDTree(centers).query(mesh.vertices)[1]]
    known = owners >= 0
    shares = np.zeros((count, kinds))
    np.add.at(shares, (piece[known], owners[known]), 1.0)
    shares /= np.bincount(piece, minlength=count)[:, None]
    present = shares > JOINED
    return np.flatnonzero(present[present.sum(axis=1) > 1].any(axis=0)).tolist()
