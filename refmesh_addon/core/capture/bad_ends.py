"""The first and the last frame of a take, judged by the frames on their one side.

No frame beyond shows that what is lost comes back, so the rule is stricter: the frames beside must hardly change, limits are twice as
large, and a body that is there alone, or is missing as a whole, may have left or come. Only a second copy of another body is in
excess, and a body that is far from where it is next, while nothing else moves, has leapt.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from .frame_change import SMALL, FrameChange, differing_samples, frame_change, isolated_pieces
from .pieces import Pieces, alike

BESIDE = 3  # frames beside the first or last one that must agree with each other
STRICT = 2.0  # times as large as elsewhere are the shares of surface and volume that show a fault
LEAP = 0.2  # share of the diagonal that no body moves from a frame to the next, after which it stays


@dataclass(frozen=True)
class EndFault:
    """reason : what is wrong with a frame, for a person.  place : (3,) about where, scene units."""

    reason: str
    place: np.ndarray


def end_fault(end: Pieces, beside: Sequence[Pieces]) -> EndFault | None:
    """What is wrong with the first or the last frame of a take, if anything.  beside : BESIDE frames, the nearest first."""
    if not all(frame_change(one, other, 1).is_small(0.0) for one, other in pairwise(beside)):
        return None
    lost, new = differing_samples(beside[0], end)
    coming, leaving = isolated_pieces(beside[0], lost), isolated_pieces(end, new)
    if coming.all() or leaving.all():
        return None
    return _leap(end, beside[0], leaving, coming) or _copy(end, leaving) or _rest(end, beside[0], (lost, new), (coming, leaving))


def _leap(end: Pieces, beside: Pieces, leaving: np.ndarray, coming: np.ndarray) -> EndFault | None:
    """leaving, coming : (K,) bool, pieces that are far from all of the other frame."""
    diagonal = float(np.linalg.norm(np.ptp(beside.samples, axis=0)))
    for piece in np.flatnonzero(leaving):
        there = np.flatnonzero(coming)
        offsets = _middles(beside)[there[alike(end, piece, beside, there)]] - _middles(end)[piece]
        away = np.linalg.norm(offsets, axis=1).min(initial=np.inf) / diagonal
        if LEAP < away < np.inf:
            return EndFault(f"a body is {away:.0%} of the diagonal away from where it is in the frame beside", _middles(end)[piece])
    return None


def _copy(end: Pieces, leaving: np.ndarray) -> EndFault | None:
    shares = end.areas / end.areas.sum()
    for piece in np.flatnonzero(leaving & (shares >= SMALL)):
        if alike(end, piece, end, np.flatnonzero(~leaving)).any():
            return EndFault(f"{shares[piece]:.0%} of the surface is in excess", _middles(end)[piece])
    return None


def _rest(
    end: Pieces, beside: Pieces, differing: tuple[np.ndarray, np.ndarray], without: tuple[np.ndarray, np.ndarray]
) -> EndFault | None:
    """What bodies have lost or gained that are there in both frames.

    differing : samples of `beside` and of `end` that are far from the other.  without : pieces of each that do not count.
    """
    kept = [~pieces[frame.piece] for pieces, frame in zip(without, (beside, end), strict=True)]
    lost, new = differing[0] & kept[0], differing[1] & kept[1]
    before, now = (frame.volumes[~pieces].sum() for pieces, frame in zip(without, (beside, end), strict=True))
    growth = float(now / max(before, np.finfo(float).tiny) - 1.0)
    place = next(some.mean(axis=0) for some in (beside.samples[lost], end.samples[new], end.samples) if len(some))
    reason = FrameChange(float(lost.mean()), float(new.mean()), growth, place, leaps=False).reason_beyond(STRICT)
    return EndFault(reason, place) if reason else None


def _middles(frame: Pieces) -> np.ndarray:
    """(K, 3) middles of the points on each piece."""
    return frame.queries.mean(axis=1)
