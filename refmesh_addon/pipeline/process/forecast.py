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
# Share of a stage that results of earlier runs, or of probes for the review of segments, may have done where its time is still measured.
MOST_SKIPPED = 0.3
FULLEST = 0.99  # of the bar, until the job is done: it may have to repeat a part of a stage
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


class _Stage:
    """How far one stage is, over all visits to it.

    worked : share of its expected time that what was done in this run stands for; more than 1 where parts were repeated.
    """

    def __init__(self, expected: StageTime):
        self._expected = expected
        self.spent, self.worked = 0.0, 0.0
        self._at, self._skipped = 0.0, 0.0
        self._trace = [(0.0, 0.0)]  # (share, seconds spent by then)

    @property
    def remaining(self) -> float:
        """Share of its expected time."""
        return 1.0 - self._expected.passed(self._at)

    def move(self, share: float, skipped: bool) -> bool:
        """Goes to a share of the progress; whether that is news. Back only where a part is done again, not where it is looked up."""
        if 0.0 < share < self._at and not skipped:
            self._at = share
            self._trace = [row for row in self._trace if row[0] < share]
        if share <= self._at:
            return False
        if skipped:
            self._skipped += share - self._at
        else:
            self.worked += self._expected.passed(share) - self._expected.passed(self._at)
        self._at = share
        self._trace.append((share, self.spent))
        return True

    def measured(self, frames: int) -> StageTime | None:
        """What the stage took; None where it was not done as a whole, or by an earlier run."""
        if self._at < 1.0 or self._skipped > MOST_SKIPPED or self.spent <= 0:
            return None
        shares, times = (np.array(column) for column in zip(*[*self._trace, (1.0, self.spent)], strict=True))
        curve = np.interp(np.linspace(0.0, 1.0, STEPS + 1), shares, times / self.spent)
        return StageTime(self.spent / frames, tuple(curve.tolist()), measured=True)


class Forecast:
    """Follows the progress of the stages of one job.

    times : of each stage, in order.  frames : how many the job has.  finished : called at the end with each stage, and its
    `StageTime`, that was done from its start to its end.  clock : seconds.

    A job may come back to a stage, as where one mesh turns out not to serve the take. All of its visits are one measurement.
    """

    def __init__(
        self,
        times: Mapping[str, StageTime],
        frames: int = 1,
        finished: Callable[[str, StageTime], None] = lambda stage, taken: None,
        clock: Callable[[], float] = time.monotonic,
    ):
        self._frames, self._finished, self._clock = max(frames, 1), finished, clock
        self._seconds = {name: taken.seconds * self._frames for name, taken in times.items()}
        self._stages = {name: _Stage(taken) for name, taken in times.items()}
        self._stage = ""
        self._start = self._heard = self._advanced = clock()
        self._trust = TRUST * self._remaining() if all(item.measured for item in times.values()) else 0.0
        self._share = 0.0

    def advance(self, stage: str, share: float, skipped: bool = False) -> None:
        """A stage has reached a share of its progress; `skipped`: by results of an earlier run, so that it took no time."""
        self._spend()
        self._stage = stage
        if self._stages[stage].move(share, skipped):
            self._advanced = self._heard

    def end(self) -> None:
        """The job is done."""
        self._spend()
        for name, stage in self._stages.items():
            taken = stage.measured(self._frames)
            if taken is not None:
                self._finished(name, taken)

    @property
    def share(self) -> float:
        """Share of the work of this run that is done; never falls. What an earlier run has done does not count."""
        worked, remaining = self._worked(), self._remaining()
        done = worked / (worked + remaining) if worked + remaining > 0 else 1.0
        self._share = max(self._share, min(done, FULLEST))
        return self._share

    @property
    def left(self) -> float | None:
        """Seconds until the job is done; None while too little is known."""
        elapsed, worked, remaining = self._advanced - self._start, self._worked(), self._remaining()
        sure = self._trust > 0 or (elapsed > UNSURE_SECONDS and worked > UNSURE_SHARE * (worked + remaining))
        if not sure:
            return None
        pace = (elapsed + self._trust) / max(worked + self._trust, 1e-9)
        left = pace * remaining
        return max(left - (self._clock() - self._advanced), LEAST * left)

    def _spend(self) -> None:
        """The time since the last event was that of the stage at work."""
        now = self._clock()
        if self._stage:
            self._stages[self._stage].spent += now - self._heard
        self._heard = now

    def _worked(self) -> float:
        """Seconds that what was done in this run should have taken."""
        return sum(self._seconds[name] * stage.worked for name, stage in self._stages.items())

    def _remaining(self) -> float:
        return sum(self._seconds[name] * stage.remaining for name, stage in self._stages.items())
