"""Progress of a job as text and as a bar."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

BAR_FORMAT = "{desc} {percentage:3.0f}%|{bar}| {elapsed}, {remaining} left"
ASK_AFTER = 60.0  # seconds of work from which on a job asks before it is canceled
LOG_INTERVAL = 10.0  # seconds between two lines where stderr is a log file, not a terminal


class Clock:
    """Describes what a job is doing and estimates the time left from the time it has taken so far."""

    def __init__(self):
        self._start = time.monotonic()

    def describe(self, event) -> str:
        """For a progress event: "tracking, frame 8, 42 %, 1:20 left"."""
        passed = time.monotonic() - self._start
        left = f", {minutes(passed * (1 - event.share) / event.share)} left" if event.share > 0 else ""
        return f"{stage_and_frame(event)}, {event.share:.0%}{left}"

    def at_stake(self, event) -> str:
        """What to tell a person who is about to cancel the job; "" while it has only begun."""
        if time.monotonic() - self._start < ASK_AFTER:
            return ""
        return f"{event.share:.0%} is done. What is finished is kept, and the next run continues from there"


def stage_and_frame(event) -> str:
    """For an event: "tracking, frame 8"."""
    return event.stage if event.frame is None else f"{event.stage}, frame {event.frame}"


def minutes(seconds: float) -> str:
    """Seconds as 1:20."""
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"


@contextmanager
def progress_bar(quiet: bool) -> Iterator[Callable]:
    """A function that takes the events of a job and draws a bar of them on stderr, or draws nothing if `quiet`."""
    from tqdm import tqdm

    interval = 0.1 if sys.stderr.isatty() else LOG_INTERVAL
    # smoothing=0: the time left comes from the whole time so far, as the stages differ in speed.
    with tqdm(total=1.0, bar_format=BAR_FORMAT, smoothing=0, mininterval=interval, miniters=0, disable=quiet, file=sys.stderr) as bar:
        stage = ""

        def advance(event):
            nonlocal stage
            if event.kind == "warning" and not quiet:
                bar.write(f"warning: {event.message}", file=sys.stderr)
            bar.set_description_str(stage_and_frame(event), refresh=event.stage != stage)  # a new stage is shown at once
            bar.update(event.share - bar.n)
            stage = event.stage

        yield advance
