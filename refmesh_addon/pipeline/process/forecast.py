"""How far a job is and how long it will take, from the time that its stages took last on this machine."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

STEPS = 20  # of the curve of a stage
UNMEASURED = 5.0  # seconds for each frame of a whole job of which nothing is known; corrected as soon as it runs
TRUST = 0.2  # share of the time expected at the start that counts as seen already, where all of it was measured
# A job of which little is known tells no time before it has worked for so many seconds, and done this share.
UNSURE_SECONDS, UNSURE_SHARE = 10.0, 0.1
MOST_SKIPPED = 0.15  # share of a stage that earlier runs may have done, such as reading its frames, where its time is still a measurement
RESERVED = 0.2  # share of what is left of the bar that is kept for another pass through the stages, where the job may need one
LEAST = 0.1  # of an estimate that is left, however long the unit at work takes


@dataclass(frozen=True)
class StageTime:
    """Time that a stage takes.

    seconds : for each frame.  curve : share of that time that has passed at each of STEPS + 1 equal steps of the stage's progress.
    measured : whether with these settings on this machine.
    """

    seconds: float
    curve: tuple[float, ...] = tuple(np.linspace(0.0, 1.0, STEPS + 1).tolist())
    measured: bool = False

    def passed(self, share: float) -> float:
        """Share of the time that has passed at a share of the progress."""
        return float(np.interp(share, np.linspace(0.0, 1.0, STEPS + 1), self.curve))


class Forecast:
    """Follows the progress of the stages of one job.

    times : of each stage, in order.  frames : how many the job has.  finished : called with a stage, and its `StageTime`, that was
    done from its start to its end.  clock : seconds.
    repeats : whether the job may go back to earlier stages, as where one mesh turns out not to serve the take; nobody knows how often.
    """

    def __init__(
        self,
        times: Mapping[str, StageTime],
        frames: int = 1,
        finished: Callable[[str, StageTime], None] = lambda stage, taken: None,
        clock: Callable[[], float] = time.monotonic,
        repeats: bool = False,
    ):
        self._times, self._frames, self._finished, self._clock = dict(times), max(frames, 1), finished, clock
        self._stages, self._stage, self._at = list(times), "", 0.0
        self._worked = 0.0  # seconds that what was done in this run should have taken
        self._start = self._advanced = clock()
        self._trace: list[tuple[float, float]] = []  # (share, time) of the stage
        self._skipped = 0.0  # share of the stage
        self._trust = TRUST * self._remaining() if all(item.measured for item in self._times.values()) else 0.0
        self._limit = 1.0 - RESERVED if repeats else 1.0
        self._share, self._pass_share, self._pass_worked = 0.0, 0.0, 0.0  # the latter two: at the beginning of this pass

    def advance(self, stage: str, share: float, skipped: bool = False) -> None:
        """A stage has reached a share of its progress; `skipped`: by results of an earlier run, so that it took no time."""
        now = self._clock()
        if stage != self._stage:
            self._end_stage(now)
            if self._stage and self._stages.index(stage) < self._stages.index(self._stage):
                self._pass_share, self._pass_worked = self.share, self._worked
            self._stage, self._at, self._trace, self._skipped = stage, 0.0, [(0.0, now)], 0.0
        if share > self._at:
            time_of = self._times[stage]
            if skipped:
                self._skipped += share - self._at
            else:
                self._worked += time_of.seconds * self._frames * (time_of.passed(share) - time_of.passed(self._at))
            self._at, self._advanced = share, now
            self._trace.append((share, now))

    def end(self) -> None:
        """The job is done."""
        self._end_stage(self._clock())

    @property
    def share(self) -> float:
        """Share of the work of this run that is done; never falls. What an earlier run has done does not count."""
        worked, remaining = self._worked - self._pass_worked, self._remaining()
        done = worked / (worked + remaining) if worked + remaining > 0 else 1.0
        self._share = max(self._share, self._pass_share + (1.0 - self._pass_share) * self._limit * done)
        return self._share

    @property
    def left(self) -> float | None:
        """Seconds until the job is done; None while too little is known."""
        elapsed, whole = self._advanced - self._start, self._worked + self._remaining()
        sure = self._trust > 0 or (elapsed > UNSURE_SECONDS and self._worked > UNSURE_SHARE * whole)
        if not sure:
            return None
        pace = (elapsed + self._trust) / max(self._worked + self._trust, 1e-9)
        left = pace * self._remaining()
        return max(left - (self._clock() - self._advanced), LEAST * left)

    def _remaining(self) -> float:
        at = self._stages.index(self._stage) if self._stage else 0
        shares = [1.0 - self._times[self._stages[at]].passed(self._at)] + [1.0] * (len(self._stages) - at - 1)
        return sum(part * self._times[name].seconds * self._frames for part, name in zip(shares, self._stages[at:], strict=True))

    def _end_stage(self, now: float) -> None:
        if not self._stage or self._skipped > MOST_SKIPPED:
            return
        shares, times = (np.array(column) for column in zip(*[*self._trace, (1.0, now)], strict=True))
        taken = now - times[0]
        if taken > 0:
            curve = np.interp(np.linspace(0.0, 1.0, STEPS + 1), shares, (times - times[0]) / taken)
            self._finished(self._stage, StageTime(float(taken) / self._frames, tuple(curve.tolist()), measured=True))
