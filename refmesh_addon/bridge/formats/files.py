"""Files of an export that are complete or absent, and refused where the disk is too small."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ...core.errors import RefMeshError
from ...io.files import PARTIAL_SUFFIX, atomic_file
from .export import Export

# Bytes in Alembic or USD, half more than measured: position and velocity of a vertex in each frame; a triangle, written once.
BYTES_PER_SAMPLE, BYTES_PER_TRIANGLE = 36, 60


def check_result(source: Path) -> None:
    """Raises RefMeshError when a file of the results is missing."""
    if not source.is_file():
        raise RefMeshError(f"{source}: is missing; run the Deform step again")


def copy_result(source: Path, target: Path) -> Path:
    """Copies a file of the results; returns the target. Raises RefMeshError when it is missing or cannot be written."""
    check_result(source)
    with open(source, "rb") as original, atomic_file(target) as copy:
        shutil.copyfileobj(original, copy)
    return target


def check_disk_space(export: Export, target: Path) -> None:
    """Raises RefMeshError when the disk is too small: Blender's exporters of Alembic and USD crash on a full one."""
    meshes = [export.owner.refmesh.groups[index].deformed.data for index in export.choice.groups]
    samples = sum(len(mesh.vertices) for mesh in meshes) * (export.choice.last - export.choice.first + 1)
    needed = BYTES_PER_SAMPLE * samples + BYTES_PER_TRIANGLE * sum(len(mesh.polygons) for mesh in meshes)
    free = shutil.disk_usage(target.parent).free
    if free < needed:
        reason = f"No space left on device: {needed / 1e6:.1f} MB may be needed, {free / 1e6:.1f} MB are free"
        raise RefMeshError(f"{target}: cannot be written ({reason})")


@contextmanager
def replacing(target: Path) -> Iterator[Path]:
    """A path beside the target to write to, which becomes the target when the block ends without an error.

    For exporters that insist on their extension and raise RuntimeError; `io.files.atomic_file` serves everything else.
    """
    partial = target.with_name(f"{target.stem}{PARTIAL_SUFFIX}{target.suffix}")
    try:
        partial.unlink(missing_ok=True)  # an exporter would follow a link
        yield partial
        os.replace(partial, target)
    except (RuntimeError, OSError) as error:
        raise RefMeshError(f"{target}: cannot be written ({_reason(error)})") from error
    finally:
        partial.unlink(missing_ok=True)


def _reason(error: Exception) -> str:
    """The last line of the message: an exporter written in Python reports its whole traceback."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip() and not line.startswith("Location: ")]
    return lines[-1] if lines else type(error).__name__
