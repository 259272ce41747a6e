"""Progress of a job as text and as a bar."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

BAR_FORMAT = "{desc} {percentage:3.0f}%|{bar}| {elapsed}{postfix}"
NOT_YET = 1e-9  # seconds until a bar shows itself; not while it is built, where an interrupt would leave its line open
LEAST_LEFT = 1.0  # seconds that an estimate is taken for at least
# The time left that is shown never grows, unless the job will take longer than it says by this factor and so many seconds more.
LONGER, LONGER_SECONDS = 2.0, 10.0
ASK_AFTER = 60.0  # seconds of work from which on a job asks before it is canceled
LOG_INTERVAL = 10.0  # seconds between two lines where stderr is a log file, not a terminal


class Clock:
    """Describes what a job is doing, how far it is and how long it will take; moves on between the job's events.

    The bar always moves, and its time left never grows: where the job turns out to take longer, both move more slowly, so that they end
    together. A person is told where that would mislead.
    """

    def __init__(self):
        self._start = self._moved = self._heard = time.monotonic()
        self._event = None
        self._left: float | None = None
        self._estimate = 0.0
        self.share = 0.0

    def hear(self, event) -> None:
        """Takes a progress event of the job."""
        self._event, self._heard = event, time.monotonic()
        self.move()

    def move(self) -> None:
        """Brings share and time left up to the present."""
        now, event = time.monotonic(), self._event
        passed, self._moved = now - self._moved, now
        if event is None:
            return
        self.share = max(self.share, event.share)
        if event.left is None:
            return
        estimate = event.left * math.exp(-(now - self._heard) / max(event.left, LEAST_LEFT))  # slower and slower without news
        self._estimate = max(event.left - (now - self._heard), estimate)
        before = estimate if self._left is None else self._left
        self._left = min(before * math.exp(-passed / max(estimate, LEAST_LEFT)), estimate)
        if before > 0:
            self.share = 1 - (1 - self.share) * self._left / before

    @property
    def time_left(self) -> str:
        """ "1:20 left"; "" while nothing is known."""
        if self._left is None:
            return ""
        if self._estimate > LONGER * self._left + LONGER_SECONDS:
            return f"{minutes(self._estimate)} left, longer than expected"
        return f"{minutes(self._left)} left"

    def describe(self) -> str:
        """ "tracking, frame 8, 42.1%, 1:20 left"."""
        return ", ".join(filter(None, (stage_and_frame(self._event), f"{self.share:.1%}", self.time_left)))

    def at_stake(self) -> str:
        """What to tell a person who is about to cancel the job; "" while it has only begun."""
        if time.monotonic() - self._start < ASK_AFTER:
            return ""
        return f"{self.share:.0%} is done. What is finished is kept, and the next run continues from there"


def stage_and_frame(event) -> str:
    """For an event: "tracking, frame 8"."""
    return event.stage if event.frame is None else f"{event.stage}, frame {event.frame}"


def minutes(seconds: float) -> str:
    """Seconds as 1:20."""
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"


@contextmanager
def progress_bar(quiet: bool) -> Iterator[Callable]:
    """A function that takes the events of a job and draws a bar of them on stderr, unless `quiet`, with warnings between."""
    from tqdm import tqdm

    interval = 0.1 if sys.stderr.isatty() else LOG_INTERVAL
    clock = Clock()
    options = {"mininterval": interval, "miniters": 0, "delay": NOT_YET, "disable": quiet, "file": sys.stderr}
    with tqdm(total=1.0, bar_format=BAR_FORMAT, **options) as bar:
        bar.refresh()
        stage = ""

        def advance(event):
            nonlocal stage
            if event.kind == "warning":
                bar.write(f"warning: {event.message}", file=sys.stderr)
            clock.hear(event)
            bar.set_description_str(stage_and_frame(event), refresh=event.stage != stage)  # a new stage is shown at once
            bar.set_postfix_str(clock.time_left, refresh=False)
            bar.update(max(clock.share, event.share) - bar.n)
            stage = event.stage

        yield advance
