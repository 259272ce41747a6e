"""One task of a job on a render farm: `python -m refmesh_addon.pipeline.process.part_worker JOBFILE INPUT OUTPUT STEP [PART COUNT]`.

Needs no Blender. Tasks of one step may run at the same time, on machines that share the output folder; steps run one after the other.
Progress goes to stdout in the form of Open Job Description, which other programs may ignore.
"""

from __future__ import annotations

import os
import sys
import time
from dataclasses import replace
from pathlib import Path

from ...core.errors import RefMeshError
from ..session.job import CACHE_FOLDER, JobSpec
from ..session.job_input import job_sequence
from .lock import job_lock, shared_lock
from .single_thread import SINGLE_THREAD

INTERVAL = 1.0  # seconds between two lines of progress


def main(arguments: list[str]) -> int:
    """Does the task and returns its exit code: 0 when it is done, 1 when not."""
    os.environ.update(SINGLE_THREAD)
    try:
        _run(*arguments)
    except (RefMeshError, ImportError, MemoryError) as error:
        message = " ".join(str(error).split()) or "out of memory: take a machine with more, or a lower --resolution"
        print(f"openjd_fail: {message}", flush=True)
        print(message, file=sys.stderr)
        return 1
    return 0


def _run(job_file: str, source: str, output: str, name: str, number: str = "1", count: str = "1") -> None:
    from ..run import compute, run  # late: numpy comes with it
    from ..session.part import Part
    from ..stages.steps import RESULTS, find_step

    spec = replace(_read(job_file), source=source, output=output, resume=True)
    step = find_step(spec, name)
    if step is None:
        raise RefMeshError(f"{job_file}: the job has no step '{name}'; export it again")
    sequence, progress = job_sequence(spec), _Progress()
    folder = Path(output) / CACHE_FOLDER
    if name == RESULTS:
        with job_lock(folder, output):
            run(spec, progress.notify, progress.warn, sequence=sequence)
    elif step.share is None:
        with job_lock(folder, output):
            compute(spec, sequence, progress.notify, progress.warn, step.name)
    else:
        with shared_lock(folder, output):
            part = Part(step.share, int(number), int(count))
            compute(spec, sequence, progress.notify, progress.warn, part)


def _read(job_file: str) -> JobSpec:
    try:
        return JobSpec.from_json(Path(job_file).read_text(encoding="utf-8"))
    except OSError as error:
        raise RefMeshError(f"{job_file}: the job file cannot be read ({error.strerror})") from error


class _Progress:
    """Lines that a render farm shows."""

    def __init__(self) -> None:
        self._last = float("-inf")

    def notify(self, stage: str, frame: int | None, share: float, skipped: bool = False) -> None:
        now = time.monotonic()
        if now - self._last >= INTERVAL:
            self._last = now
            print(f"openjd_status: {stage}" + ("" if frame is None else f", frame {frame}"), flush=True)
            print(f"openjd_progress: {100 * share:.1f}", flush=True)

    def warn(self, message: str) -> None:
        print(message, flush=True)


if __name__ == "__main__":
    if len(sys.argv) not in (5, 7):
        sys.exit("usage: python -m refmesh_addon.pipeline.process.part_worker JOBFILE INPUT OUTPUT STEP [PART COUNT]")
    sys.exit(main(sys.argv[1:]))
