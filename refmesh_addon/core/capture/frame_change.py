"""What changes from one frame to another beyond what motion explains: surface and volume that are lost, new, or elsewhere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .pieces import Pieces

REACH = 0.035  # share of the diagonal that a surface moves from frame to frame without being lost; more for frames farther apart
NOTICEABLE = 0.02  # share of the surface that has to be lost or added
VOLUME = 0.02  # share of the volume by which it has to fall or rise with it
JUMP = 0.15  # share by which the volume alone must jump
ALL = 0.75  # share of the surface, lost and new, beyond which a frame has nothing in common with the one before
AGREEING = 0.5  # of those shares, by which the frames before and after may differ
SMALL = 0.25  # share of the surface below which a piece that comes from nowhere is something else, and no copy of the body
ISOLATED = 0.9  # share of the points of such a piece that are far from the surface before
LEAPT = 0.5  # share of such a piece that must be lost elsewhere for it to be a body that has leapt


@dataclass(frozen=True)
class FrameChange:
    """From one frame to another: shares of the surface that are lost and that are new, of the volume, and where it is worst.

    leaps : whether what is lost has come back elsewhere, so that the volume is the same in all.
    """

    lost: float
    new: float
    growth: float
    place: np.ndarray
    leaps: bool

    @property
    def reason(self) -> str:
        """What has happened, if it is more than motion explains; nothing where all is elsewhere, as in another unit."""
        return self.reason_beyond(1.0)

    def reason_beyond(self, factor: float) -> str:
        """The same with all limits but ALL that many times as large."""
        if min(self.lost, self.new) > ALL:
            return ""
        if self.lost > factor * NOTICEABLE and self.growth < -factor * VOLUME:
            return f"{self.lost:.0%} of the surface is missing"
        if self.new > factor * NOTICEABLE and self.growth > factor * VOLUME:
            return f"{self.new:.0%} of the surface is in excess"
        if abs(self.growth) > factor * JUMP:
            return f"it encloses {abs(self.growth):.0%} {'more' if self.growth > 0 else 'less'} volume"
        return ""

    @property
    def is_calm(self) -> bool:
        """Whether nothing moves fast."""
        return max(self.lost, self.new) <= AGREEING * NOTICEABLE

    def is_small(self, growth: float) -> bool:
        """Whether motion explains it, with room to spare.  growth : of the frames between, beside which the volume may vary."""
        limits = ((self.lost, NOTICEABLE), (self.new, NOTICEABLE), (abs(self.growth), max(VOLUME, abs(growth))))
        return all(value <= AGREEING * limit for value, limit in limits)


def frame_change(before: Pieces, now: Pieces, apart: int) -> FrameChange:
    """apart : by how many frames."""
    lost, new = differing_samples(before, now, apart)
    strange = _strange(now, new, float(lost.mean()))
    kept = ~strange[now.piece]
    growth, total = (float(now.volumes[own].sum() / max(before.volumes.sum(), np.finfo(float).tiny) - 1.0) for own in (~strange, ...))
    places = [before.samples[lost], now.samples[new & kept], now.samples]
    place = next(some.mean(axis=0) for some in places if len(some))
    return FrameChange(float(lost.mean()), float((new & kept).mean()), growth, place, leaps=total > -VOLUME > growth)


def differing_samples(before: Pieces, now: Pieces, apart: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """(N,) bool, which samples of one frame are far from all of the other: those that are lost, of `before`, and new, of `now`."""
    reach = REACH * apart * float(np.linalg.norm(np.ptp(before.samples, axis=0)))
    lost = cKDTree(now.samples).query(before.samples)[0] > reach
    return lost, cKDTree(before.samples).query(now.samples)[0] > reach


def isolated_pieces(frame: Pieces, differing: np.ndarray) -> np.ndarray:
    """(K,) bool, pieces of a frame that are far from all of another.  differing : (N,) bool, of its samples."""
    count = len(frame.areas)
    return np.bincount(frame.piece, differing, count) > ISOLATED * np.maximum(np.bincount(frame.piece, minlength=count), 1)


def _strange(now: Pieces, new: np.ndarray, lost: float) -> np.ndarray:
    """(K,) bool, pieces that have come from nowhere and do not count: too small to be copies, or instead of what is lost, which has leapt.

    new : (N,) bool, of the samples.  lost : share of the surface before.
    """
    shares = now.areas / max(float(now.areas.sum()), np.finfo(float).tiny)
    strange = isolated_pieces(now, new) & ((shares < SMALL) | (lost > LEAPT * shares))
    return strange & ~strange.all()
