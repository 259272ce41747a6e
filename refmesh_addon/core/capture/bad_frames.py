"""Frames in which something is lost, doubled or leaps away for a moment, between two frames that agree with each other.

A frame is judged by the frames around it only: where the frame before and one soon after agree, but what lies between lacks surface
and volume that both have, or has what neither has, no motion explains it. An arm that swings comes back as well, but keeps its
volume. A ball that bounces comes back like one that has leapt away for a frame, but moves as fast before and after.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .pieces import Pieces

LONGEST = 5  # frames in a row that count as a moment
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
class BadFrame:
    """index : of the frame.  before, after : indices of the frames around that agree.
    reason : what is wrong with it, for a person.  place : (3,) about where, scene units.
    """

    index: int
    before: int
    after: int
    reason: str
    place: np.ndarray


@dataclass(frozen=True)
class _Change:
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
        if min(self.lost, self.new) > ALL:
            return ""
        if self.lost > NOTICEABLE and self.growth < -VOLUME:
            return f"{self.lost:.0%} of the surface is missing"
        if self.new > NOTICEABLE and self.growth > VOLUME:
            return f"{self.new:.0%} of the surface is in excess"
        if abs(self.growth) > JUMP:
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


class BadFrameSearch:
    """Looks for the bad frames of a take while its frames are read one after the other; the first and the last one never are bad."""

    def __init__(self) -> None:
        self._found: list[BadFrame] = []
        self._last: Pieces | None = None  # before the window
        self._window: deque[Pieces] = deque()
        self._first = 0  # index of the frame in front

    def add(self, frame: Pieces) -> None:
        """The next frame; a few are kept."""
        self._window.append(frame)
        if len(self._window) == LONGEST + 2:
            self._advance()

    def finished(self) -> tuple[BadFrame, ...]:
        """All bad frames, once all frames were added."""
        while len(self._window) > 2:
            self._advance()
        return tuple(self._found)

    def _advance(self) -> None:
        after = _agreeing(self._window, self._last)
        self._found += _between(self._window, after, self._first)
        self._first += after
        self._last = self._window[0] if after == 1 else None  # otherwise bad ones lie between
        for _ in range(after):
            self._window.popleft()


def bad_frames(frames: Iterable[Pieces]) -> tuple[BadFrame, ...]:
    """The bad frames of a take."""
    search = BadFrameSearch()
    for frame in frames:
        search.add(frame)
    return search.finished()


def _agreeing(window: deque[Pieces], last: Pieces | None) -> int:
    """Position of the next frame that agrees with the one in front, where all between are bad; otherwise 1.

    last : the frame before the window, if any.
    """
    front = window[0]
    first = _changed(front, window[1], 1)
    if not first.reason:
        return 1
    for after in range(2, len(window)):
        there = window[after]
        if _changed(front, there, after).is_small(first.growth):
            changes = [_changed(end, window[i], after) for i in range(1, after) for end in (front, there)]
            bad = all(change.reason for change in changes)
            leaps = any(change.leaps for change in changes)
            return after if bad and not (leaps and (_fast(last, front) or _fast(there, _at(window, after + 1)))) else 1
    return 1


def _at(window: deque[Pieces], position: int) -> Pieces | None:
    return window[position] if position < len(window) else None


def _fast(before: Pieces | None, after: Pieces | None) -> bool:
    """Whether something moves fast from one frame to the next, if there are both."""
    return before is not None and after is not None and not _changed(before, after, 1).is_calm


def _between(window: deque[Pieces], after: int, first: int) -> list[BadFrame]:
    changes = [_changed(window[0], window[position], after) for position in range(1, after)]
    return [BadFrame(first + i, first, first + after, change.reason, change.place) for i, change in enumerate(changes, 1)]


def _changed(before: Pieces, now: Pieces, apart: int) -> _Change:
    """apart : by how many frames."""
    reach = REACH * apart * float(np.linalg.norm(np.ptp(before.samples, axis=0)))
    lost = cKDTree(now.samples).query(before.samples)[0] > reach
    new = cKDTree(before.samples).query(now.samples)[0] > reach
    strange = _strange(now, new, float(lost.mean()))
    kept = ~strange[now.piece]
    growth, total = (float(now.volumes[own].sum() / max(before.volumes.sum(), np.finfo(float).tiny) - 1.0) for own in (~strange, ...))
    places = [before.samples[lost], now.samples[new & kept], now.samples]
    place = next(some.mean(axis=0) for some in places if len(some))
    return _Change(float(lost.mean()), float((new & kept).mean()), growth, place, leaps=total > -VOLUME > growth)


def _strange(now: Pieces, new: np.ndarray, lost: float) -> np.ndarray:
    """(K,) bool, pieces that have come from nowhere and do not count: too small to be copies, or instead of what is lost, which has leapt.

    new : (N,) bool, of the samples.  lost : share of the surface before.
    """
    count, shares = len(now.areas), now.areas / max(float(now.areas.sum()), np.finfo(float).tiny)
    isolated = np.bincount(now.piece, new, count) > ISOLATED * np.maximum(np.bincount(now.piece, minlength=count), 1)
    strange = isolated & ((shares < SMALL) | (lost > LEAPT * shares))
    return strange & ~strange.all()
