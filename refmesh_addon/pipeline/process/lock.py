"""One job at a time in an output folder."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import BinaryIO

from ...core.errors import RefMeshError
from ...io.files import output_folder

LOCK_NAME = "lock"
_LOCKED_BYTE = 1 << 20  # far beyond the text: Windows does not let others read a locked byte


@contextmanager
def output_lock(folder: str | Path, output: str | Path) -> Iterator[None]:
    """Holds the lock file in `folder`, the cache of `output`, for the length of a block.

    The operating system releases the lock when the process ends, however it ends, so a crash leaves none behind.
    Raises RefMeshError, naming the process, when another job holds it.
    """
    path = output_folder(folder) / LOCK_NAME
    with ExitStack() as stack:
        try:
            file = stack.enter_context(open(path, "a+b"))
        except OSError as error:
            raise RefMeshError(f"{path}: the lock file cannot be opened ({error.strerror or error})") from error
        if not _try_lock(file):
            raise RefMeshError(
                f"{output}: another RefMesh job{_holder(path)} is writing here; wait for it, cancel it, or choose another folder"
            )
        file.truncate(0)
        file.write(str(os.getpid()).encode("ascii"))
        file.flush()
        yield  # closing the file releases the lock


def _holder(path: Path) -> str:
    text = path.read_bytes()[:20].decode("ascii", "replace")
    return f" (process {text})" if text.isdigit() else ""


if sys.platform == "win32":
    import msvcrt

    def _try_lock(file: BinaryIO) -> bool:
        file.seek(_LOCKED_BYTE)
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        return True

else:
    import fcntl

    def _try_lock(file: BinaryIO) -> bool:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError:
            return True  # a network disk without locks: better no protection than no result
        return True
