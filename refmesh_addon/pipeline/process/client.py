"""The parent's side of a worker process: start it, hear from it, stop it, never wait for it."""

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
# Seconds that a worker may take to stop by itself, so that a cancelled job is gone within one, also where the window is slow
# to draw and the key is noticed late. Ending it loses no more
# than its own stop at the next progress step would: all its files are whole or absent at any time.
CANCEL_GRACE = 0.3
GENTLE = 5  # the priority, as `nice` counts, of a worker beside a window
READ_GRACE = 2.0  # seconds in which what an ended worker left in its pipes is read
LAST_WORDS = 5  # lines of stderr that a dead worker's message quotes
_WAIT = 0.1  # seconds between two looks at a silent worker


class WorkerProcess:
    """One job in a process of its own. Ask `poll` now and then, or go through `events`; the last event is final.

    gentle : it lets other programs go first, such as a window that is to stay alive.
    Raises RefMeshError when there is no Python to start.
    """

    def __init__(self, spec: JobSpec, gentle: bool = False):
        self._events: queue.SimpleQueue[Event] = queue.SimpleQueue()
        self._last_words: deque[str] = deque(maxlen=LAST_WORDS)
        self._cancelled_at: float | None = None
        self._ended_at: float | None = None
        self._final: Event | None = None
        self._delivered = False
        self._job_file = _write_job(spec)
        try:
            self._process = _start(self._job_file, gentle)
        except BaseException:
            os.unlink(self._job_file)
            raise
        self._readers = [threading.Thread(target=read, daemon=True) for read in (self._read_events, self._read_errors)]
        for reader in self._readers:
            reader.start()

    @property
    def running(self) -> bool:
        """True until the final event was given out."""
        return not self._delivered

    @property
    def pid(self) -> int:
        """Process id of the worker."""
        return self._process.pid

    def poll(self) -> list[Event]:
        """What came since the last call; never blocks. The final event comes last, when the process has ended."""
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
            events.append(self._final or self._obituary())
        return events

    def events(self) -> Iterator[Event]:
        """Every event as it comes, until the final one; waits in between."""
        while self.running:
            events = self.poll()
            yield from events
            if not events:
                time.sleep(_WAIT)

    def cancel(self) -> None:
        """Asks the worker, if it still runs, to stop; one that does not within a grace time is ended by a later `poll`."""
        if self.running and self._cancelled_at is None:
            self._cancelled_at = time.monotonic()
            with contextlib.suppress(OSError):  # it ended by itself
                self._process.stdin.write(b"cancel\n")
                self._process.stdin.flush()

    def _has_ended(self) -> bool:
        """Ended, and everything it said is read; helpers of a killed worker may keep its stderr open a little longer."""
        if self._process.poll() is None:
            return False
        self._ended_at = self._ended_at or time.monotonic()
        overdue = time.monotonic() - self._ended_at > READ_GRACE
        return overdue or not any(reader.is_alive() for reader in self._readers)

    def _enforce_cancel(self) -> None:
        overdue = self._cancelled_at is not None and time.monotonic() - self._cancelled_at > CANCEL_GRACE
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
                    self._last_words.append(line.decode("utf-8", "replace").strip())

    def _obituary(self) -> Event:
        if self._cancelled_at is not None:
            return Event("cancelled")
        words = " | ".join(self._last_words) or "it left no message"
        if os.name != "nt" and self._process.returncode == -signal.SIGKILL:
            words = "the system ended it, as it does when memory runs out; take a lower resolution or fewer frames"
        return Event("failed", f"the worker process ended unexpectedly (exit code {self._process.returncode}): {words}")

    def _close(self) -> None:
        with contextlib.suppress(OSError):  # what it never read; the other pipes are closed by their readers
            self._process.stdin.close()
        with contextlib.suppress(OSError):
            os.unlink(self._job_file)


def _write_job(spec: JobSpec) -> str:
    descriptor, path = tempfile.mkstemp(prefix="refmesh-", suffix=".json")
    with os.fdopen(descriptor, "w", encoding="utf-8") as file:
        file.write(spec.to_json())
    return path


def _start(job_file: str, gentle: bool) -> subprocess.Popen:
    # A session of its own, so that Ctrl-C in a terminal reaches the parent only, which then asks for an orderly end.
    if os.name == "nt":
        apart = {"creationflags": subprocess.CREATE_NO_WINDOW | (subprocess.BELOW_NORMAL_PRIORITY_CLASS if gentle else 0)}
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
    if gentle and os.name != "nt":
        with contextlib.suppress(OSError):  # it ended already
            os.setpriority(os.PRIO_PROCESS, process.pid, max(GENTLE, os.getpriority(os.PRIO_PROCESS, 0)))  # what it starts, too
    return process


def _kill(process: subprocess.Popen) -> None:
    with contextlib.suppress(OSError):  # it ended by itself
        if os.name == "nt":
            process.kill()
        else:
            os.killpg(process.pid, signal.SIGKILL)
