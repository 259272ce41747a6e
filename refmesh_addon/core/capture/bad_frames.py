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

from .bad_ends import BESIDE, end_fault
from .frame_change import frame_change
from .pieces import Pieces

LONGEST = 5  # frames in a row that count as a moment


@dataclass(frozen=True)
class BadFrame:
    """index : of the frame.  before, after : indices of the frames around that agree; of the first or the last frame, both the one beside.
    reason : what is wrong with it, for a person.  place : (3,) about where, scene units.
    """

    index: int
    before: int
    after: int
    reason: str
    place: np.ndarray


class BadFrameSearch:
    """Looks for the bad frames of a take while its frames are read one after the other."""

    def __init__(self) -> None:
        self._found: list[BadFrame] = []
        self._last: Pieces | None = None  # before the window
        self._window: deque[Pieces] = deque()
        self._first = 0  # index of the frame in front
        self._start: list[Pieces] = []
        self._end: deque[Pieces] = deque(maxlen=BESIDE + 1)

    def add(self, frame: Pieces) -> None:
        """The next frame; a few are kept."""
        if len(self._start) <= BESIDE:
            self._start.append(frame)
        self._end.append(frame)
        self._window.append(frame)
        if len(self._window) == LONGEST + 2:
            self._advance()

    def finished(self) -> tuple[BadFrame, ...]:
        """All bad frames, once all frames were added."""
        last = self._first + len(self._window) - 1
        while len(self._window) > 2:
            self._advance()
        return (*_at_end(self._start, 0, 1), *self._found, *_at_end(list(self._end)[::-1], last, last - 1))

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
    first = frame_change(front, window[1], 1)
    if not first.reason:
        return 1
    for after in range(2, len(window)):
        there = window[after]
        if frame_change(front, there, after).is_small(first.growth):
            changes = [frame_change(end, window[i], after) for i in range(1, after) for end in (front, there)]
            bad = all(change.reason for change in changes)
            leaps = any(change.leaps for change in changes)
            return after if bad and not (leaps and (_fast(last, front) or _fast(there, _at(window, after + 1)))) else 1
    return 1


def _at(window: deque[Pieces], position: int) -> Pieces | None:
    return window[position] if position < len(window) else None


def _fast(before: Pieces | None, after: Pieces | None) -> bool:
    """Whether something moves fast from one frame to the next, if there are both."""
    return before is not None and after is not None and not frame_change(before, after, 1).is_calm


def _between(window: deque[Pieces], after: int, first: int) -> list[BadFrame]:
    changes = [frame_change(window[0], window[position], after) for position in range(1, after)]
    return [BadFrame(first + i, first, first + after, change.reason, change.place) for i, change in enumerate(changes, 1)]


def _at_end(frames: list[Pieces], index: int, beside: int) -> list[BadFrame]:
    """The first or the last frame of a take, if it is bad.  frames : it and those beside it.  index, beside : of the first two."""
    fault = end_fault(frames[0], frames[1:]) if len(frames) > BESIDE else None
    return [] if fault is None else [BadFrame(index, beside, beside, fault.reason, fault.place)]
