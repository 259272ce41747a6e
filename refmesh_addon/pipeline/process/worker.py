"""The process that does the work: `python -m refmesh_addon.pipeline.process.worker JOBFILE`.

Writes one JSON line for each event to stdout. Reads stdin: the line "cancel", or its end because the parent is gone,
stops the job at the next progress step, so stdin must stay open until the job is done.
"""

from __future__ import annotations

import os
import sys
import threading
import time
import traceback
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TextIO

from ...core.errors import Canceled, RefMeshError
from ...io.files import atomic_file
from ...io.sequence import Sequence
from ..session.job import CACHE_FOLDER, JobSpec
from ..session.job_input import job_sequence
from .events import Event
from .forecast import Forecast, StageTime
from .lock import job_lock
from .measurements import remember, stage_times, without_color
from .single_thread import SINGLE_THREAD

LOG_NAME = "worker.log"
EVENT_INTERVAL = 0.05  # seconds between two progress events; a window cannot show more
ORPHAN_GRACE = 10.0  # seconds that a job whose parent is gone may take to reach its next progress step


class Reporter:
    """Turns the progress of the pipeline into events, and a request to cancel into `Canceled`."""

    def __init__(self, forecast: Forecast, send: Callable[[Event], None]):
        self.forecast = forecast
        self._send = send
        self._last_sent = float("-inf")
        self.stage = ""
        self.cancel = threading.Event()

    def progress(self, stage: str, frame: int | None, share: float, skipped: bool = False) -> None:
        """share : of this stage, 0 to 1.  skipped : reached by results of an earlier run.

        Raises Canceled once the parent has canceled the job.
        """
        if self.cancel.is_set():
            raise Canceled
        self.forecast.advance(stage, share, skipped)
        now = time.monotonic()
        if stage != self.stage or now - self._last_sent >= EVENT_INTERVAL:
            self.stage, self._last_sent = stage, now
            self._send(Event("progress", stage=stage, frame=frame, share=self.forecast.share, left=self.forecast.left))

    def group_ready(self, index: int) -> None:
        """A group can be shown while the job goes on."""
        self._send(Event("group", str(index), self.stage, share=self.forecast.share, left=self.forecast.left))

    def warn(self, message: str) -> None:
        """Something the user should know that does not stop the job."""
        self._send(Event("warning", message=message, stage=self.stage, share=self.forecast.share, left=self.forecast.left))


def main(job_file: str) -> None:
    """Runs one job and ends the process, with exit code 0 when the job is done."""
    os.environ.update(SINGLE_THREAD)
    events = _claim_stdout()

    def send(event: Event) -> None:
        print(event.to_line(), file=events, flush=True)

    outcome = _run_file(job_file, send)
    send(outcome)
    sys.stdout.flush()
    sys.stderr.flush()
    # Without the interpreter's shutdown, in which a library could still fail after the job is done.
    os._exit(0 if outcome.kind == "done" else 1)


def _run_file(job_file: str, send: Callable[[Event], None]) -> Event:
    try:
        spec = JobSpec.from_json(Path(job_file).read_text(encoding="utf-8"))
    except RefMeshError as error:
        return Event("failed", str(error))
    except OSError as error:
        return Event("failed", f"{job_file}: the job file cannot be read ({error.strerror})")
    times = stage_times(spec)
    reporter = Reporter(Forecast(times), send)
    threading.Thread(target=_listen, args=(reporter.cancel,), daemon=True).start()
    return _outcome(spec, reporter, times)


def _outcome(spec: JobSpec, reporter: Reporter, times: dict[str, StageTime]) -> Event:
    try:
        sequence = job_sequence(spec)  # first, so that a wrong input leaves no empty output folder
        with job_lock(Path(spec.output) / CACHE_FOLDER, spec.output):
            from ..run import run  # late: numpy comes with it, and a package that is missing is reported below

            times = without_color(times) if _hardly_colored(sequence) else times
            reporter.forecast = Forecast(times, len(sequence.frames), partial(remember, spec))
            run(spec, reporter.progress, reporter.warn, sequence=sequence, group_ready=reporter.group_ready)
            reporter.forecast.end()
    except Canceled:
        return Event("canceled", stage=reporter.stage)
    except RefMeshError as error:
        return Event("failed", _one_line(error), stage=reporter.stage)
    except MemoryError:
        where = reporter.stage or "reading"
        return Event("failed", f"out of memory in {where}: take fewer centers, a lower resolution, or fewer frames", stage=reporter.stage)
    except ImportError as error:
        return Event("failed", _missing(error, _log(spec)), stage=reporter.stage)
    except Exception as error:  # the edge of the process: whatever else is raised is a bug of ours, and the parent must learn of it
        where = reporter.stage or "start"
        return Event("failed", f"internal error in {where}: {_named(error)} (details in {_log(spec)})", stage=reporter.stage)
    return Event("done", share=1.0)


def _hardly_colored(sequence: Sequence) -> bool:
    """Whether the colors of an OBJ file, which are in pictures beside it as a rule, are not there."""
    from ...io.appearance import files_beside  # late, as numpy comes with it

    path = sequence.frames[0].path
    return path.suffix.lower() == ".obj" and not files_beside(path)


def _missing(error: ImportError, log: Path) -> str:
    package = (error.name or "").partition(".")[0]
    if package == __name__.partition(".")[0]:
        return f"RefMesh itself is incomplete, install it again: {_named(error)} (details in {log})"
    if isinstance(error, ModuleNotFoundError) and package:
        install = f"'{sys.executable} -m pip install {package}'"
        return f"the Python package '{package}' is missing: install the RefMesh extension, or run {install}"
    return f"a package cannot be loaded: {_one_line(error)} (details in {log})"


def _log(spec: JobSpec) -> Path:
    """Writes the traceback of the current error to a file and gives its path."""
    path = Path(spec.output) / CACHE_FOLDER / LOG_NAME
    try:
        with atomic_file(path) as file:
            file.write(traceback.format_exc().encode("utf-8", "backslashreplace"))
    except RefMeshError:
        traceback.print_exc()
    return path


def _named(error: BaseException) -> str:
    return f"{type(error).__name__}: {_one_line(error)}"


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def _claim_stdout() -> TextIO:
    """The pipe to the parent, kept for events alone; whatever libraries print goes to stderr."""
    events = os.fdopen(os.dup(1), "w", encoding="ascii")
    sys.stdout.flush()
    os.dup2(2, 1)
    return events


def _listen(cancel: threading.Event) -> None:
    # From the descriptor: a thread that waits in sys.stdin would hold a lock that the interpreter needs to shut down.
    received = b""
    while b"cancel" not in received:
        chunk = os.read(0, 4096)
        if not chunk:
            cancel.set()
            time.sleep(ORPHAN_GRACE)
            os._exit(1)
        received += chunk
    cancel.set()


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python -m refmesh_addon.pipeline.process.worker JOBFILE")
    main(sys.argv[1])
