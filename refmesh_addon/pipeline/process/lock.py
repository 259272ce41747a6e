"""One job at a time in an output folder."""

from __future__ import annotations

import errno
import os
import stat
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import BinaryIO

from ...core.errors import RefMeshError
from ...io.files import output_folder

LOCK_NAME = "lock"  # of the process that computes
SCRIPT_LOCK_NAME = "script-lock"  # of the one that also writes exports, pictures and the scene, which may be its parent
_LONGEST_ID = 20  # digits of a process id
_LOCKED_BYTE = 1 << 20  # far beyond the text: Windows does not let others read a locked byte


@contextmanager
def output_lock(folder: str | Path, output: str | Path, name: str = LOCK_NAME, heir_of: int | None = None) -> Iterator[None]:
    """Holds the lock file `name` in `folder`, the cache of `output`, for the length of a block.

    heir_of : id of a process that may hold the lock on our behalf.

    The operating system releases the lock when the process ends, however it ends, so a crash leaves none behind.
    Raises RefMeshError, naming the process, when another job holds it.
    """
    path = output_folder(folder) / name
    with ExitStack() as stack:
        try:
            file = stack.enter_context(open(path, "r+b", buffering=0, opener=_open_no_link))
        except OSError as error:
            raise RefMeshError(f"{path}: the lock file cannot be opened ({error.strerror or error}); remove what lies there") from error
        if not _try_lock(file):
            if heir_of is not None and _holder_id(path) == str(heir_of):
                yield
                return
            raise RefMeshError(
                f"{output}: another RefMesh job{_holder(path)} is writing here; wait for it, cancel it, or choose another folder"
            )
        _check_content(path)
        try:
            file.seek(0)
            file.truncate(0)
            file.write(str(os.getpid()).encode("ascii"))
        except OSError as error:
            raise RefMeshError(f"{path}: cannot be written ({error.strerror or error})") from error
        yield  # closing the file releases the lock


@contextmanager
def job_lock(folder: str | Path, output: str | Path) -> Iterator[None]:
    """Holds both locks of an output folder for the length of a block; the script's may be held by the process that started this one.

    Raises RefMeshError, naming the process, when another job holds one of them.
    """
    with output_lock(folder, output, SCRIPT_LOCK_NAME, heir_of=os.getppid()), output_lock(folder, output):
        yield


@contextmanager
def shared_lock(folder: str | Path, output: str | Path) -> Iterator[None]:
    """Holds the lock of an output folder together with others for the length of a block, and keeps out whoever wants it alone.

    Only where the system has such locks, which Windows has not. Raises RefMeshError when another job holds the folder alone.
    """
    path = output_folder(folder, shared=True) / LOCK_NAME
    with open(path, "r+b", buffering=0, opener=_open_no_link) as file:
        if not _try_lock(file, shared=True):
            raise RefMeshError(f"{output}: another RefMesh job{_holder(path)} is writing here; wait for it, or choose another folder")
        yield


_kept = ExitStack()


def keep_lock(folder: str | Path, output: str | Path) -> None:
    """Holds the script's lock until this process ends or keeps that of another folder: nobody computes there between job and exports.

    Raises RefMeshError, naming the process, when another one holds it.
    """
    _kept.close()
    _kept.enter_context(output_lock(folder, output, SCRIPT_LOCK_NAME))


def _open_no_link(path: str, flags: int) -> int:
    """Opens a regular file, created where missing; never what a link leads to, which could be any file of the user's."""
    descriptor = os.open(path, flags | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0), 0o666)
    if os.path.islink(path) or not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise OSError(errno.EINVAL, "it is not a regular file")
    return descriptor


def _check_content(path: Path) -> None:
    """Raises RefMeshError when the file holds anything but a process id: a file of somebody else's is not emptied."""
    with open(path, "rb") as file:
        content = file.read(_LONGEST_ID + 1)
    if content and not (content.isdigit() and len(content) <= _LONGEST_ID):
        raise RefMeshError(f"{path}: is not a RefMesh lock file; move it away or choose another output folder")


def _holder_id(path: Path) -> str:
    return path.read_bytes()[:_LONGEST_ID].decode("ascii", "replace")


def _holder(path: Path) -> str:
    text = _holder_id(path)
    return f" (process {text})" if text.isdigit() else ""


if sys.platform == "win32":
    import msvcrt

    def _try_lock(file: BinaryIO, shared: bool = False) -> bool:
        if shared:
            return True
        file.seek(_LOCKED_BYTE)
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        return True

else:
    import fcntl

    def _try_lock(file: BinaryIO, shared: bool = False) -> bool:
        try:
            fcntl.flock(file, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError:
            return True  # a network disk without locks: better no protection than no result
        return True
