"""Bodies that touch all the time, told apart by their motion.

Two rigid parts whose motions disagree all along their contact, by more than what lies between them could stretch, are two bodies: at a
joint, motions agree somewhere on the axis, and along a bend or a twist they agree from layer to layer. Centers at a contact are dragged
along by both sides, so what lies between may look as if it joined them; it counts as a contact only if, wherever one of the two rigid
motions carries each of its centers, there is volume in every frame, and if nothing else connects the two.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Annotated

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..capture.pieces import LARGE
from ..tracking.neighbors import neighbor_pairs
from ..tracking.rigid_parts import RigidParts, rigid_parts
from ..types import FrozenArrays
from .bodies_by_gaps import LEAST_CENTERS, GapBodies
from .marked_bodies import marked_bodies
from .separation import bodies_of

FRAMES = 9  # of a window that are compared
WINDOWS = (1, 2, 4)  # the whole take, halves and quarters, each overlapping the next by half, as drift grows; none shorter than FRAMES
CLEAR = 0.3  # by which one motion must miss the volume more, in s, than the other, to show which of the two a center has
REACH = 5.0  # distance, in s, across which two parts are compared
LEAST_PAIRS = 5  # of centers across a contact
AGREEING = 0.05  # share of those pairs whose disagreement may be smaller
STRETCHED = 1.0  # disagreement over distance that no material survives all along a contact: it would be twice as long
FILLED = 1.0  # distance, in s, of a place from the nearest center that shows it to be inside the volume


@dataclass(frozen=True)
class TakeBodies(FrozenArrays):
    """The bodies of a take.

    bodies : (C,) number of the body of each center, from 0.  rows : (B, 2) first and last of the frames that show each body apart: those
    whose motion does, those with a narrow gap, or the one with the widest; -1 for a body that is alone.  by_motion : (B,) bool, whether
    it is their motion.  joined : (B,) bool, whether centers of others were joined to it when it was tracked.
    """

    bodies: Annotated[np.ndarray, "(C) integer"]
    rows: Annotated[np.ndarray, "(B, 2) integer"]
    by_motion: Annotated[np.ndarray, "(B) bool"]
    joined: Annotated[np.ndarray, "(B) bool"]


@dataclass(frozen=True)
class Contact:
    """centers : (N,) indices of what lies between two parts.  side : (N,) 0 or 1, the part that each moves with, -1 where either may be."""

    centers: np.ndarray
    side: np.ndarray


def touching_bodies(centers: np.ndarray, spacing: float) -> np.ndarray:
    """(C,) numbers, from 0, of the bodies that do not touch in a frame.  centers : (C, 3) there.  spacing : s, scene units."""
    return bodies_of(centers, _neighbors(centers, spacing))


def bodies_by_motion(positions: np.ndarray, spacing: float, known: GapBodies, start: np.ndarray | None = None) -> TakeBodies:
    """The bodies of a take, with those that its motion shows apart.

    positions : (F, C, 3) tracked centers, scene units.  spacing : s, scene units.
    known : those that gaps have shown.  start : (C,) numbers, from 0, of coarser ones that motion may divide, as gaps that open late leave
    centers on the wrong side; None for those.
    """
    bodies = (known.bodies if start is None else start).copy()
    windows: dict[int, tuple[int, int] | None] = dict.fromkeys(range(bodies.max() + 1))
    for window in _windows(len(positions)):
        rows = np.unique(np.linspace(*window, FRAMES).astype(int))
        for body in range(len(windows)):
            own = np.flatnonzero(bodies == body)
            second = _second_body(positions[:, own], rows, spacing)
            if second.any():
                bodies[own[second]] = len(windows)
                windows[body] = windows[len(windows)] = window
    moving = _divided_by_gaps(bodies, known.bodies)
    owns = [moving == body for body in range(moving.max() + 1)]
    shown = [windows[bodies[own][0]] for own in owns]
    gaps = [known.rows[np.bincount(known.bodies[own]).argmax()].tolist() for own in owns]
    widest = lambda own: [_widest_gap(positions, own)] * 2
    rows = [window or (gap if gap[0] >= 0 else widest(own)) for own, window, gap in zip(owns, shown, gaps, strict=True)]
    by_motion = np.array([window is not None for window in shown])
    return TakeBodies(moving, np.array(rows), by_motion, by_motion | (np.array(gaps)[:, 0] >= 0))


def _divided_by_gaps(bodies: np.ndarray, known: np.ndarray) -> np.ndarray:
    """(C,) bodies, each divided where gaps show several large ones in it."""
    pairs, part, count = np.unique(np.stack([bodies, known]), axis=1, return_inverse=True, return_counts=True)
    largest = np.array([np.flatnonzero(pairs[0] == body)[np.argmax(count[pairs[0] == body])] for body in pairs[0]])
    kept = np.where(count >= LEAST_CENTERS, np.arange(len(count)), largest)
    return np.unique(kept[part.ravel()], return_inverse=True)[1]


def _widest_gap(positions: np.ndarray, own: np.ndarray) -> int:
    """The row of the frame in which a body, (C,) bool, is farthest from all others; -1 where there are no others."""
    if own.all():
        return -1
    return int(np.argmax([cKDTree(centers[~own]).query(centers[own])[0].min() for centers in positions]))


def _windows(count: int) -> Iterator[tuple[int, int]]:
    for parts in WINDOWS:
        starts = np.arange(2 * parts - 1) * (count - 1) / (2 * parts)
        yield from ((int(start), int(start + (count - 1) / parts)) for start in starts if parts == 1 or count > FRAMES * parts)


def _second_body(positions: np.ndarray, rows: np.ndarray, spacing: float) -> np.ndarray:
    """(C,) bool, the centers of a body that moves apart from the others; none where all may be one body.

    positions : (F, C, 3).  rows : of the frames that are compared.
    """
    frames, count = positions[rows], positions.shape[1]
    neighbors = _neighbors(frames[0], spacing)
    parts = rigid_parts(frames, neighbors, spacing, max(LEAST_CENTERS, round(LARGE * count)))
    for pair in combinations(range(len(parts.motions)), 2):
        if not _torn(frames[0], parts, pair, spacing):
            continue
        contact = _contact(frames, parts, pair, spacing)
        sides = None if contact is None else _sides(neighbors, parts.label, pair, contact)
        if sides is not None:
            return _divided(positions[0], spacing, sides)
    return np.zeros(count, dtype=bool)


def _neighbors(centers: np.ndarray, spacing: float) -> sparse.csr_matrix:
    """(C, C) ones between neighbors and on the diagonal."""
    first, second = neighbor_pairs(centers, spacing).T
    links = sparse.coo_matrix((np.ones(len(first)), (first, second)), (len(centers),) * 2)
    return sparse.csr_matrix(links + links.T + sparse.eye(len(centers)))


def _torn(start: np.ndarray, parts: RigidParts, pair: tuple[int, int], spacing: float) -> bool:
    """Whether what lies between two parts would have to stretch beyond any material. start : (C, 3) where the motions begin."""
    members = [np.flatnonzero(parts.label == part) for part in pair]
    trees = [cKDTree(start[own]) for own in members]
    gap = trees[0].query(start[members[1]])[0].min()
    pairs = trees[0].sparse_distance_matrix(trees[1], min(max(gap, spacing) + spacing, REACH * spacing), output_type="ndarray")
    if len(pairs) < LEAST_PAIRS:
        return False
    middle = (start[members[0][pairs["i"]]] + start[members[1][pairs["j"]]]) / 2
    images = [parts.motions[part].images(middle) for part in pair]
    disagreement = np.linalg.norm(images[0] - images[1], axis=2).max(axis=0)
    return bool(np.quantile(disagreement / np.maximum(pairs["v"], spacing), AGREEING) > STRETCHED)


def _contact(frames: np.ndarray, parts: RigidParts, pair: tuple[int, int], spacing: float) -> Contact | None:
    """What lies between two parts, if in all frames there is volume where the motion of one of them carries it; otherwise None."""
    start, label = frames[0], parts.label
    near = [cKDTree(start[label == part]).query(start)[0] < REACH * spacing for part in pair]
    between = np.flatnonzero(near[0] & near[1] & ~np.isin(label, pair))
    missed = np.array([_missed(parts.motions[part].images(start[between]), frames[1:]) for part in pair]) / spacing
    if (missed.min(axis=0) > FILLED).any():
        return None
    clear = np.abs(missed[0] - missed[1]) > CLEAR
    return Contact(between, np.where(clear, missed.argmin(axis=0), -1))


def _missed(images: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """(N,) largest distance of (F, N, 3) places from the nearest of the (F, C, 3) centers of their frame."""
    return np.max([cKDTree(centers).query(places)[0] for places, centers in zip(images, frames, strict=True)], axis=0)


def _sides(
    neighbors: sparse.csr_matrix, label: np.ndarray, pair: tuple[int, int], contact: Contact
) -> tuple[np.ndarray, np.ndarray] | None:
    """Centers on both sides of a contact, as indices; None where the two are connected elsewhere."""
    rest = np.setdiff1d(np.arange(len(label)), contact.centers)
    links = neighbors[rest][:, rest].tocoo()
    first, second = label[rest][links.row], label[rest][links.col]
    across = np.isin(first, pair) & np.isin(second, pair) & (first != second)
    links = sparse.coo_matrix((links.data[~across], (links.row[~across], links.col[~across])), links.shape)
    _, piece = connected_components(links, directed=False)
    own, other = (piece[label[rest] == part][0] for part in pair)
    if own == other:
        return None
    return tuple(
        np.concatenate([rest[piece == side], contact.centers[contact.side == index]]) for index, side in enumerate((own, other))
    )


def _divided(start: np.ndarray, spacing: float, sides: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """(C,) bool, the centers of the second side, with those from which no narrower cut divides it.  start : (C, 3) in the first frame."""
    body = marked_bodies(start[None], spacing, sides)
    known, unknown = np.concatenate(sides), body < 0
    body[unknown] = body[known[cKDTree(start[known]).query(start[unknown])[1]]]
    return body == 1
