"""The parent's side of a worker process: starts, polls and cancels it without blocking."""

from __future__ import annotations

import contextlib
import os
import queue
import signal
import subprocess
import tempfile
import threading
import time
from collections import deque
from collections.abc import Iterator

from ..session.job import JobSpec
from .environment import python_command, worker_environment
from .events import Event

WORKER_MODULE = "refmesh_addon.pipeline.process.worker"
# Seconds that a worker may take to stop by itself, so that a canceled job is gone within one second even where the window is
# slow to draw and notices the key late. Killing it loses no more than its own stop at the next progress step would: all its
# files are whole or absent at any time.
CANCEL_GRACE = 0.3
LOW_PRIORITY = 5  # the `nice` value of a worker beside a window
READ_GRACE = 2.0  # seconds in which the pipes of a worker that has ended are emptied
STDERR_LINES = 5  # last lines of stderr that the message about a crash quotes
_WAIT = 0.1  # seconds between two polls of a silent worker


class WorkerProcess:
    """One job in a process of its own. Call `poll` regularly, or iterate over `events`; the last event is final.

    low_priority : so that a window stays responsive while the job runs.
    Raises RefMeshError when there is no Python to start.
    """

    def __init__(self, spec: JobSpec, low_priority: bool = False):
        self._events: queue.SimpleQueue[Event] = queue.SimpleQueue()
        self._last_lines: deque[str] = deque(maxlen=STDERR_LINES)
        self._canceled_at: float | None = None
        self._ended_at: float | None = None
        self._final: Event | None = None
        self._delivered = False
        self._job_file = _write_job(spec)
        try:
            self._process = _start(self._job_file, low_priority)
        except BaseException:
            os.unlink(self._job_file)
            raise
        self._readers = [threading.Thread(target=read, daemon=True) for read in (self._read_events, self._read_errors)]
        for reader in self._readers:
            reader.start()

    @property
    def running(self) -> bool:
        """True until `poll` has returned the final event."""
        return not self._delivered

    @property
    def pid(self) -> int:
        """Process id of the worker."""
        return self._process.pid

    def poll(self) -> list[Event]:
        """The events since the last call; never blocks. The final event comes last, once the process has ended."""
        self._enforce_cancel()
        ended = self._has_ended()
        events = []
        while not self._events.empty():
            event = self._events.get()
            if event.is_final:
                self._final = event
            else:
                events.append(event)
        if ended and not self._delivered:
            self._delivered = True
            self._close()
            events.append(self._final or self._event_of_a_crash())
        return events

    def events(self) -> Iterator[Event]:
        """Every event as it arrives, until the final one; waits in between."""
        while self.running:
            events = self.poll()
            yield from events
            if not events:
                time.sleep(_WAIT)

    def cancel(self) -> None:
        """Asks a running worker to stop; a later `poll` kills it if it does not within a grace period."""
        if self.running and self._canceled_at is None:
            self._canceled_at = time.monotonic()
            with contextlib.suppress(OSError):  # it ended by itself
                self._process.stdin.write(b"cancel\n")
                self._process.stdin.flush()

    def _has_ended(self) -> bool:
        """Whether it has ended and its output is read; processes of a killed worker may keep its stderr open a little longer."""
        if self._process.poll() is None:
            return False
        self._ended_at = self._ended_at or time.monotonic()
        overdue = time.monotonic() - self._ended_at > READ_GRACE
        return overdue or not any(reader.is_alive() for reader in self._readers)

    def _enforce_cancel(self) -> None:
        overdue = self._canceled_at is not None and time.monotonic() - self._canceled_at > CANCEL_GRACE
        if overdue and self._process.poll() is None:
            _kill(self._process)

    def _read_events(self) -> None:
        with self._process.stdout as lines:
            for line in lines:
                event = Event.from_line(line.decode("utf-8", "replace"))
                if event:
                    self._events.put(event)

    def _read_errors(self) -> None:
        with self._process.stderr as lines:
            for line in lines:
                if line.strip():
                    self._last_lines.append(line.decode("utf-8", "replace").strip())

    def _event_of_a_crash(self) -> Event:
        if self._canceled_at is not None:
            return Event("canceled")
        reason = " | ".join(self._last_lines) or "it left no message"
        if os.name != "nt" and self._process.returncode == -signal.SIGKILL:
            reason = "the system ended it, as it does when memory runs out; take a lower resolution or fewer frames"
        return Event("failed", f"the worker process ended unexpectedly (exit code {self._process.returncode}): {reason}")

    def _close(self) -> None:
        with contextlib.suppress(OSError):  # it may not have read all; the other pipes are closed by their readers
            self._process.stdin.close()
        with contextlib.suppress(OSError):
            os.unlink(self._job_file)


def _write_job(spec: JobSpec) -> str:
    descriptor, path = tempfile.mkstemp(prefix="refmesh-", suffix=".json")
    with os.fdopen(descriptor, "w", encoding="utf-8") as file:
        file.write(spec.to_json())
    return path


def _start(job_file: str, low_priority: bool) -> subprocess.Popen:
    # A session of its own, so that Ctrl-C in a terminal reaches the parent only, which then cancels the job.
    if os.name == "nt":
        apart = {"creationflags": subprocess.CREATE_NO_WINDOW | (subprocess.BELOW_NORMAL_PRIORITY_CLASS if low_priority else 0)}
    else:
        apart = {"start_new_session": True}
    process = subprocess.Popen(
        [*python_command(), "-m", WORKER_MODULE, job_file],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=worker_environment(),
        **apart,
    )
    if low_priority and os.name != "nt":
        with contextlib.suppress(OSError):  # it ended already
            os.setpriority(os.PRIO_PROCESS, process.pid, max(LOW_PRIORITY, os.getpriority(os.PRIO_PROCESS, 0)))  # what it starts, too
    return process


def _kill(process: subprocess.Popen) -> None:
    with contextlib.suppress(OSError):  # it ended by itself
        if os.name == "nt":
            process.kill()
        else:
            os.killpg(process.pid, signal.SIGKILL)
