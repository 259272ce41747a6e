"""What every stage of one run shares."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from ...core.settings import Settings
from ...io.discovery import find_sequence
from ...io.files import output_folder
from ...io.frame_range import format_ranges
from ...io.report import Report
from .cache import Cache
from .frames import Frames
from .job import CACHE_FOLDER, JobSpec
from .parallel import Workers

READING_SHARE = 0.1  # of the tracking stage, for reading and checking the frames

Notify = Callable[[str, int | None, float], None]


@dataclass
class Context:
    """One run: its input, where results go, and whom to tell.

    notify : (stage, frame number or None, share of the stage); raises Cancelled when nobody wants the job any more.
    warn : one line for a person, which the report keeps too.
    """

    frames: Frames
    settings: Settings
    output: Path
    cache: Cache
    report: Report
    notify: Notify
    warn: Callable[[str], None]
    workers: Workers

    @classmethod
    def open(cls, spec: JobSpec, notify: Notify, warn: Callable[[str], None], workers: Workers) -> Context:
        """Finds and reads the frames. Raises RefMeshError for input or output that cannot be used."""
        sequence = find_sequence(spec.source, spec.frames)
        output = output_folder(spec.output)
        report = Report(spec.source, sequence, spec.settings)

        def note(message: str) -> None:
            report.warnings.append(message)
            warn(message)

        if sequence.gaps:
            note(f"{sequence.name}: frames {format_ranges(sequence.gaps)} are missing; the one before is held")
        cache = Cache(output / CACHE_FOLDER, spec.resume)
        frames = Frames(sequence, cache, note, lambda number, share: notify("tracking", number, READING_SHARE * share))
        report.bbox_diagonal = frames.diagonal
        return cls(frames, spec.settings, output, cache, report, notify, note, workers)

    @property
    def numbers(self) -> tuple[int, ...]:
        """Number of each frame as in its file name."""
        return self.frames.sequence.numbers

    @contextmanager
    def timed(self, stage: str) -> Iterator[None]:
        """Notes the seconds of a stage and writes the report when it is done."""
        start = time.perf_counter()
        self.notify(stage, None, READING_SHARE if stage == "tracking" else 0.0)
        yield
        self.report.seconds[stage] = time.perf_counter() - start
        self.report.write(self.output)

    def remove_stale(self, pattern: str, keep: list[str]) -> None:
        """Removes results of earlier runs that match and are not among the paths to keep, all relative to the output folder."""
        kept = {self.output / path for path in keep}
        for path in self.output.glob(pattern):
            if path not in kept:
                path.unlink(missing_ok=True)
