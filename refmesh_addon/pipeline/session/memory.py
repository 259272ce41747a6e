"""How much memory this machine has left for worker processes."""

from __future__ import annotations

import os
import sys
from pathlib import Path

_CGROUP = Path("/sys/fs/cgroup")  # of a container: its own limit counts, not what the machine has
_UNKNOWN = 1 << 62


# What a worker process takes at most, measured over all stages: with little to do, for each triangle of a frame, and for each of a
# reference mesh, whose factors are the largest part.
BASE_BYTES, FRAME_TRIANGLE_BYTES, REFERENCE_TRIANGLE_BYTES = 150_000_000, 1_000, 8_000


def task_bytes(frame: int, reference: int) -> int:
    """Bytes that a process needs, roughly, for frames and reference meshes of so many triangles."""
    return BASE_BYTES + FRAME_TRIANGLE_BYTES * frame + REFERENCE_TRIANGLE_BYTES * reference


def available_memory() -> int:
    """Bytes that processes could still take without swapping; very many where the system does not say."""
    if sys.platform == "win32":
        return _windows()
    return min(_free(), _container(_CGROUP))


def _free() -> int:
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        return next(1024 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable:"))
    except (OSError, StopIteration, ValueError, IndexError):
        return _half_of_all()


def _half_of_all() -> int:
    """Where only the size of the memory is known, as on macOS."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2
    except (AttributeError, ValueError, OSError):
        return _UNKNOWN


def _container(folder: Path) -> int:
    try:
        limit, used = ((folder / name).read_text(encoding="ascii").strip() for name in ("memory.max", "memory.current"))
        inactive = next(line.split()[1] for line in (folder / "memory.stat").read_text().splitlines() if line.startswith("inactive_file "))
        return max(int(limit) - int(used) + int(inactive), 0)  # files that were read are only kept while nothing else needs their place
    except (OSError, ValueError, StopIteration, IndexError):  # no limit says "max"
        return _UNKNOWN


def _windows() -> int:
    import ctypes

    class Status(ctypes.Structure):
        _fields_ = [("length", ctypes.c_ulong), ("load", ctypes.c_ulong), *((name, ctypes.c_ulonglong) for name in "abcdefg")]

    status = Status(ctypes.sizeof(Status))
    known = ctypes.windll.kernel32.GlobalMemoryStatusEx(ctypes.byref(status))
    return int(status.b) if known else _UNKNOWN  # ullAvailPhys, the second of the sizes
