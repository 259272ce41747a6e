"""Bodies that touch in most frames, told apart by frames whose surface falls into several pieces.

Centers on both sides of a gap narrower than their spacing keep their affinity, and one surface reconstructed for both has a neck across
the gap. But matter that is one body never has a gap in it. A capture that has lost a wrist has one, so a gap counts only where all
frames show it, or where what joins its sides in the frame before or after it is a contact that is just closing: much narrower than what
lies on either side of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree

from ..capture.pieces import LARGE
from ..geometry.closest_point import SurfaceIndex
from ..geometry.mesh import vertex_components
from ..geometry.voxels import fill, grid_of
from ..geometry.winding import Winding
from ..types import TriangleMesh

LEAST_CENTERS = 40  # of a piece or a part that shows a body, and at least its share LARGE
VOXEL = 0.25  # s, side of the voxels in which a contact is measured
DEEP = 2.0  # s, how far from a contact what lies on either side of it is measured
# Least volume there on either side, in prisms over the contact: limbs have about one on their own side, a head on a thin neck has 1.7,
# a ball that begins to rest on a box 2 to 10.
NARROW = 2.0
SHARED = 0.01  # share of the centers that may lie in two pieces at once where captured teeth dig into each other


@dataclass(frozen=True)
class GapBodies:
    """bodies : (C,) number of the body of each center, from 0.

    rows : (B, 2) first and last of the frames whose gap divides a body from another; -1 for one that was known before.
    """

    bodies: np.ndarray
    rows: np.ndarray

    @classmethod
    def known(cls, bodies: np.ndarray) -> GapBodies:
        """Those of (C,) numbers, none divided."""
        return cls(bodies, np.full((int(bodies.max()) + 1, 2), -1))


def bodies_by_gaps(
    positions: np.ndarray, spacing: float, known: np.ndarray, rows: Iterable[int], body: Callable[[int], TriangleMesh]
) -> GapBodies:
    """The bodies of a take: those that are known, divided where a contact inside one of them opens.

    positions : (F, C, 3) tracked centers, scene units.  spacing : s, scene units.  known : (C,) numbers from 0.
    rows : of the frames with several large pieces.  body : gives the closed surface of a frame by its row.
    """
    pieces = {row: _piece_of(body(row), positions[row]) for row in rows}
    bodies, number, least = known.copy(), 0, max(LEAST_CENTERS, LARGE * len(known))
    rows_of = GapBodies.known(known).rows.tolist()
    while number < len(rows_of):  # ends: each division leaves two bodies smaller than the one before
        own = np.flatnonzero(bodies == number)
        sides = {row: side for row in sorted(pieces) if (side := _sides(pieces[row][own], least)) is not None}
        run = _opening(positions[:, own], spacing, sides, body)
        second = _second_body([sides[row] for row in run])
        if second.any():
            bodies[own[second]] = len(rows_of)
            rows_of[number] = [run[0], run[-1]]
            rows_of.append(rows_of[number])
        else:
            number += 1
    return GapBodies(bodies, np.array(rows_of))


def _piece_of(surface: TriangleMesh, centers: np.ndarray) -> np.ndarray:
    """(C,) number of the piece of a surface that each of (C, 3) centers is in, or nearest to."""
    _, label = vertex_components(surface)
    return label[surface.triangles[SurfaceIndex(surface).query(centers).triangles, 0]]


def _sides(piece: np.ndarray, least: float) -> np.ndarray | None:
    """(C,) 0 for centers of the largest piece, 1 for those of the next largest, -1 for others; None where there is one large one only."""
    numbers, count = np.unique(piece, return_counts=True)
    if (count >= least).sum() < 2:
        return None
    largest, second = numbers[np.argsort(-count, kind="stable")[:2]]
    return np.where(piece == largest, 0, np.where(piece == second, 1, -1))


def _opening(positions: np.ndarray, spacing: float, sides: dict[int, np.ndarray], body: Callable[[int], TriangleMesh]) -> list[int]:
    """Rows of consecutive frames in which a contact is open; none where no contact opens.

    Where no frame shows anything between the sides, as between gears with clearance, nothing can be a torn limb.
    positions : (F, C, 3) of one body.  sides : by row, of the frames with gaps.
    """
    if len(sides) == len(positions):
        return [] if any(_overlap(body(row), positions[row]) for row in (0, len(positions) - 1)) else sorted(sides)
    for run in _runs(list(sides)):
        for row, beside in ((run[0], run[0] - 1), (run[-1], run[-1] + 1)):
            if 0 <= beside < len(positions) and _is_narrow(body(beside), positions[beside], sides[row], spacing):
                return run
    return []


def _overlap(body: TriangleMesh, centers: np.ndarray) -> bool:
    """Whether pieces of a surface lie in each other, as clothes on a body do, so that there is no gap.  centers : (C, 3) inside."""
    return bool(np.mean(Winding(body).of(centers) > 1) > SHARED)


def _runs(rows: list[int]) -> Iterator[list[int]]:
    """Sorted rows as runs of consecutive ones."""
    for run in np.split(np.array(rows, dtype=int), np.flatnonzero(np.diff(rows) > 1) + 1):
        if len(run):
            yield run.tolist()


def _is_narrow(body: TriangleMesh, centers: np.ndarray, side: np.ndarray, spacing: float) -> bool:
    """Whether what joins two sides is narrow for what lies on either side of it.

    body : closed surface of a frame in which they are joined.  centers : (C, 3) there.  side : (C,) 0, 1 or -1.  spacing : s.
    """
    grid = grid_of(body.vertices, VOXEL * spacing)
    inside = fill(body, grid)
    owner = np.full(inside.shape, -1)
    owner[inside] = side[cKDTree(centers).query(grid.positions(inside))[1]]
    contact, area = _between(owner)
    if not contact.any():
        return False
    near = distance_transform_edt(~contact) <= DEEP / VOXEL
    volume = min(np.count_nonzero(near & (owner == own)) for own in (0, 1))
    return bool(volume > NARROW * area * DEEP / VOXEL)


def _between(owner: np.ndarray) -> tuple[np.ndarray, float]:
    """Voxels at the faces between voxels of owners 0 and 1, a boolean array, and the area of the contact there, in faces.

    The sum of the faces as vectors: their number depends on how the contact lies in the grid.
    """
    contact, area = np.zeros(owner.shape, dtype=bool), np.zeros(3)
    for axis in range(3):
        own, mark = np.moveaxis(owner, axis, 0), np.moveaxis(contact, axis, 0)
        faces = (own[1:] >= 0) & (own[:-1] >= 0) & (own[1:] != own[:-1])
        mark[1:] |= faces
        mark[:-1] |= faces
        area[axis] = (own[1:] - own[:-1])[faces].sum()
    return contact, float(np.linalg.norm(area))


def _second_body(sides: list[np.ndarray]) -> np.ndarray:
    """(C,) bool, the centers of the second body, by most of the frames that show it.  sides : (C,) 0, 1 or -1 in each; none for none.

    In each frame side 0 is the larger piece, which may be now the one body, now the other.
    """
    swapped = [np.mean(side == 1 - sides[0]) > np.mean(side == sides[0]) for side in sides]
    return np.mean([side == (0 if other else 1) for side, other in zip(sides, swapped, strict=True)] or [np.zeros(1)], axis=0) > 0.5
