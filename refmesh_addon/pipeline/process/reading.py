"""The parent's side of the process that reads files: starts it when it is needed, asks and waits."""

from __future__ import annotations

import contextlib
import io
import json
import os
import subprocess
import threading
from pathlib import Path
from typing import IO

import numpy as np

from ...core.errors import RefMeshError
from ...io.npz_reader import loaded_arrays
from ...io.preview import PreviewMesh
from ...io.source_colors import SourceColors
from .environment import python_command, worker_environment
from .single_thread import SINGLE_THREAD

MODULE = "refmesh_addon.pipeline.process.reading_process"
# Seconds that a file may take, and bytes per second beyond that: a hundred times what the slowest reader takes.
TIME_LIMIT, LEAST_SPEED = 60.0, 50_000


class ReadingProcess:
    """Reads files in a process of its own, one after the other; used from one thread."""

    def __init__(self, time_limit: float = TIME_LIMIT):
        self._process: subprocess.Popen | None = None
        self._time_limit = time_limit

    def call(self, task: str, *arguments: str | int) -> dict[str, np.ndarray]:
        """What a task of `reading_process` returns; its first argument is the path of the file.

        Raises RefMeshError, naming the file, when it cannot be read, takes too long or ends the process, and ImportError for a package
        that is missing.
        """
        line = json.dumps({"task": task, "arguments": arguments}).encode("ascii") + b"\n"
        path, limit = Path(str(arguments[0])), self._time_limit
        with contextlib.suppress(OSError):
            limit += path.stat().st_size / LEAST_SPEED
        for _ in range(2):  # once more where the process had just ended, as it does after some time without a request
            process = self._started()
            late = threading.Timer(limit, process.kill)
            late.start()
            try:
                head, data = _asked(process, line)
            finally:
                overdue = not late.is_alive()
                late.cancel()
            if head is not None:
                return _outcome(head, data)
            if process.wait() != 0:
                break
        reason = f"takes longer than {limit:.0f} seconds" if overdue else "ends the process that reads it, probably out of memory"
        raise RefMeshError(f"{path}: cannot be read: it {reason}; export it again")

    def close(self) -> None:
        """Ends the process; the next call starts another one."""
        self._end()

    def _end(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            _pipe(self._process.stdin).close()
            _pipe(self._process.stdout).close()
            self._process = None

    def _started(self) -> subprocess.Popen:
        if self._process is not None and self._process.poll() is not None:
            self._end()
        if self._process is None:
            apart = {"creationflags": subprocess.CREATE_NO_WINDOW} if os.name == "nt" else {"start_new_session": True}
            self._process = subprocess.Popen(
                [*python_command(), "-m", MODULE],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env={**worker_environment(), **SINGLE_THREAD},
                **apart,
            )
        return self._process


def _asked(process: subprocess.Popen, line: bytes) -> tuple[dict | None, bytes]:
    """Head and bytes of the answer; None where the process has ended."""
    try:
        _pipe(process.stdin).write(line)
        _pipe(process.stdin).flush()
        head = json.loads(_pipe(process.stdout).readline())
        data = _pipe(process.stdout).read(head.get("size", 0))
    except (OSError, ValueError):
        return None, b""
    return (head, data) if len(data) == head.get("size", 0) else (None, b"")


def _outcome(head: dict, data: bytes) -> dict[str, np.ndarray]:
    if "package" in head:
        raise ModuleNotFoundError(head["error"], name=head["package"])
    if "error" in head:
        raise RefMeshError(head["error"])
    return loaded_arrays(io.BytesIO(data))


def _pipe(pipe: IO[bytes] | None) -> IO[bytes]:
    assert pipe is not None, "opened with the process"
    return pipe


SHARED = ReadingProcess()  # one for the whole of Blender


def read_frame(path: Path) -> PreviewMesh:
    """The mesh of a file as Blender shows it. Raises what `ReadingProcess.call` raises."""
    return PreviewMesh(**SHARED.call("frame", str(path)))


def read_surface_kind(path: Path) -> str:
    """What kind of surface a mesh file holds, one of `openness.KINDS`. Raises what `ReadingProcess.call` raises."""
    return str(SHARED.call("surface", str(path))["kind"])


def read_colors(path: Path, folder: Path) -> SourceColors:
    """The colors of a file as Blender shows them; pictures inside of it are written to the folder. Raises as `read_frame`."""
    return SourceColors.from_arrays(SHARED.call("colors", str(path), str(folder)))
