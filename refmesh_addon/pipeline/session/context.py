"""What every stage of one run shares."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from ...core.capture.openness import SIDES
from ...core.reference.budget import triangle_budget
from ...core.settings import Settings
from ...io.files import output_folder
from ...io.frame_range import format_frames
from ...io.report import REPORT_NAME, Report
from ...io.sequence import Sequence, held_frames
from .cache import Cache
from .frames import Frames, read_frames
from .job import CACHE_FOLDER, TRACKING, JobSpec
from .left_out import LeftOut
from .memory import task_bytes
from .part import Part
from .session import Session, WorkerPool
from .stage_share import Notify, StageShare
from .written_files import WrittenFiles

READING_SHARE = 0.1  # of the tracking stage, for reading and checking the frames


@dataclass
class Context(Session):
    """One run of the stages: its input, where results go, and whom to tell.

    warn : one line for a person, which the report keeps too.  group_ready : called with the index of each group once its frames can
    be played, while others are still being deformed.  left_out : bad frames of the take, which no stage knows of.
    """

    frames: Frames
    settings: Settings
    report: Report
    warn: Callable[[str], None]
    group_ready: Callable[[int], None] = lambda index: None
    left_out: LeftOut = LeftOut()

    @classmethod
    def open(
        cls,
        spec: JobSpec,
        sequence: Sequence,
        notify: Notify,
        warn: Callable[[str], None],
        workers: WorkerPool,
        part: Part | None = None,
    ) -> Context:
        """Reads the frames of the sequence. Raises RefMeshError for input or output that cannot be used."""
        shared = part is not None
        output = output_folder(spec.output, shared)
        report = Report(spec.source, sequence, spec.settings)

        def warn_and_report(message: str) -> None:
            report.warnings.append(message)
            warn(message)

        for warning in spec.warnings:
            warn_and_report(warning)
        for note in sequence.notes:
            warn_and_report(f"{sequence.name}: {note}")
        if sequence.gaps:
            over = "; a mesh that both sides share moves on over a few" if spec.settings.tracking.bad_frames == "bridge" else ""
            lacking = format_frames(sequence.gaps, {*sequence.numbers, *sequence.gaps})
            warn_and_report(f"{sequence.name} lacks {lacking}; the frame before is held{over}")
        cache = Cache(output / CACHE_FOLDER, spec.resume, warn_and_report, shared)
        session = Session(output, cache, workers, notify, part=part)
        reading = StageShare(TRACKING, 0.0, READING_SHARE)
        frames, bad = read_frames(session, sequence, reading, warn_and_report, spec.settings.tracking)
        left_out = LeftOut.of(bad, sequence.numbers, spec.settings.tracking.bad_frames == "bridge")
        left_out.report(report, warn_and_report)
        needed = [one.needed_triangles for one in frames.statistics]
        reference = triangle_budget(spec.settings.reference.triangles, frames.counts, needed, SIDES[frames.kind])
        if workers.fit_memory(task_bytes(max(frames.counts), reference)):
            # Not for the report, which is the same on every machine.
            warn(f"only {workers.count} processes work at a time, as more would not fit in memory")
        report.surface = frames.kind
        report.bbox_diagonal, report.offset = frames.diagonal, tuple(frames.offset.tolist())
        return cls(output, cache, workers, notify, frames, spec.settings, report, warn_and_report, part=part, left_out=left_out)

    @property
    def numbers(self) -> tuple[int, ...]:
        """Number of each frame as in its file name."""
        return self.frames.sequence.numbers

    @cached_property
    def shown(self) -> tuple[int, ...]:
        """For each scene frame from first to last, the index of the frame it shows; missing and bad ones hold the one before."""
        return held_frames(self.report.sequence, self.numbers)

    @cached_property
    def cuts(self) -> tuple[int, ...]:
        """Indices of the frames that no mesh may share with the frame before."""
        after = () if self.left_out.bridged else {bad.after for bad in self.left_out.frames if bad.before != bad.after}
        return tuple(sorted(self.numbers.index(number) for number in after))

    @contextmanager
    def timed(self, stage: str) -> Iterator[None]:
        """Adds to the seconds of a stage and writes the report when it is done."""
        start = time.perf_counter()
        self.notify(stage, None, READING_SHARE if stage == TRACKING else 0.0)
        yield
        self.report.seconds[stage] = self.report.seconds.get(stage, 0.0) + time.perf_counter() - start
        self.write_report()

    def without_progress(self) -> Context:
        """The same for work that is not a fixed share of a stage: it can be canceled, and names its frames."""
        return replace(self, notify=lambda stage, frame, *_: self.notify(stage, frame, 0.0))

    def remove_stale(self, pattern: str, keep: list[str]) -> None:
        """Removes results of earlier runs that match and are not among the paths to keep, all relative to the output folder."""
        self.written_files.remove_stale(pattern, keep)

    def claim(self, name: str) -> Path:
        """Where to write a result, by its name relative to the output folder. Raises RefMeshError for a file of somebody else's."""
        return self.written_files.claim(name)

    def write_report(self) -> None:
        """Writes report.json as far as the run has come; a part of a run leaves that to the last step."""
        if self.part is None:
            self.claim(REPORT_NAME)
            self.report.write(self.output)

    @cached_property
    def written_files(self) -> WrittenFiles:
        """The files in the output folder that this run and earlier ones have written."""
        return WrittenFiles(self.output)
