"""Regular files only: a pipe in the place of a file would be waited for without end, and a device read without end."""

from __future__ import annotations

import json
import os
import stat
from pathlib import Path
from typing import Any, BinaryIO


def open_regular(path: str | Path) -> BinaryIO:
    """A regular file, opened to read bytes. Raises OSError where there is none, or a device, a pipe or a folder in its place."""
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_BINARY", 0) | getattr(os, "O_NONBLOCK", 0))
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise OSError("it is not a regular file")
    return os.fdopen(descriptor, "rb")


def read_regular(path: str | Path) -> bytes:
    """All bytes of a regular file. Raises OSError as `open_regular` does."""
    with open_regular(path) as file:
        return file.read()


def read_json(path: str | Path) -> Any:
    """What a JSON file holds. Raises OSError as `open_regular` does, and ValueError when it is not JSON or nested too deeply."""
    try:
        return json.loads(read_regular(path))
    except RecursionError as error:
        raise ValueError("it is nested too deeply") from error
