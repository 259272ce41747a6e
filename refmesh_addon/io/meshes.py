"""Reads the mesh of a frame from a file of any format, with the checks that every stage relies on."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..core.counted import counted
from ..core.errors import RefMeshError
from ..core.geometry.mesh import merged, triangle_areas
from ..core.types import TriangleMesh
from .formats import frame_format
from .polygons import ParsedMesh
from .regular_files import read_regular

SMALLEST, LARGEST = 1e-30, 1e30  # diagonals, far within what single precision holds, in which Blender keeps positions
LEAST_PRECISION = 1e-4  # step of double precision at a body, share of its diagonal; beyond that the results get visibly worse


def read_mesh(path: str | Path) -> TriangleMesh:
    """The triangles of a mesh file in one of FRAME_FORMATS, in the file's own coordinates.

    Polygons are triangulated, all objects of a scene are taken together in their places, and everything but geometry
    is ignored. Duplicated vertices along UV seams, unused vertices, holes and floating parts are left as they are;
    only STL, which knows no shared vertices, is merged.
    Raises RefMeshError, naming the file, when it cannot be read, is empty or truncated, has coordinates that are not
    finite, triangles whose vertices do not exist, no triangles, or no area.
    """
    path = Path(path)
    return parse_mesh(read_bytes(path), path)


def read_bytes(path: str | Path) -> bytes:
    """All bytes of an input file. Raises RefMeshError, naming it, when it cannot be read or is empty."""
    try:
        data = read_regular(path)
    except OSError as error:
        raise RefMeshError(f"{path}: cannot be read ({error.strerror or error})") from error
    if not data.strip():
        raise RefMeshError(f"{path}: the file is empty")
    return data


def parse_mesh(data: bytes, path: str | Path) -> TriangleMesh:
    """What `read_mesh` does, for the bytes of a file that were read already; `path` gives the format and is named in messages."""
    return parse_frame(data, path)[0]


def parse_frame(data: bytes, path: str | Path) -> tuple[TriangleMesh, int]:
    """What `parse_mesh` does, and how many faces were left out because they have fewer than three corners.

    Raises RefMeshError, naming the file, as `parse_mesh` does.
    """
    path = Path(path)
    known = frame_format(path)
    assert known.parse is not None
    try:
        parsed = known.parse(data)
        mesh = _checked(path, _without_unused_infinities(parsed))
    except ValueError as error:
        reason = str(error).partition("\n")[0] or type(error).__name__
        raise RefMeshError(f"{path}: cannot be read as {known.name.upper()}: {reason}") from error
    except RecursionError as error:
        raise RefMeshError(f"{path}: cannot be read as {known.name.upper()}: it is nested too deeply") from error
    except MemoryError as error:
        raise RefMeshError(f"{path}: needs more memory than there is; export this frame with fewer triangles") from error
    return mesh if known.shared_vertices else merged(mesh)[0], parsed.omitted


def _without_unused_infinities(parsed: ParsedMesh) -> ParsedMesh:
    """Without the vertices that are not finite and that no triangle uses."""
    vertices, triangles, omitted = parsed
    finite = np.isfinite(vertices).all(axis=1)
    if finite.all() or not len(triangles) or triangles.min() < 0 or triangles.max() >= len(vertices):
        return parsed
    kept = finite.copy()
    kept[triangles.ravel()] = True
    return ParsedMesh(vertices[kept], (np.cumsum(kept) - 1)[triangles], omitted)


def _checked(path: Path, parsed: ParsedMesh) -> TriangleMesh:
    vertices, triangles, omitted = parsed
    if not len(triangles):
        faces = f"{counted(omitted, 'face has', 'faces have')} fewer than three corners" if omitted else "is the file truncated?"
        raise RefMeshError(f"{path}: holds no triangles; {faces}")
    finite = np.isfinite(vertices).all(axis=1)
    if not finite.all():
        count, first = np.count_nonzero(~finite), int(np.argmin(finite))
        vertices_have = counted(count, "vertex has", "vertices have")
        raise RefMeshError(f"{path}: {vertices_have} coordinates that are not finite numbers (the first is vertex {first + 1})")
    outside = ((triangles < 0) | (triangles >= len(vertices))).any(axis=1)
    if outside.any():
        count, first = np.count_nonzero(outside), int(np.argmax(outside))
        triangles_use = counted(count, "triangle uses", "triangles use")
        raise RefMeshError(
            f"{path}: {triangles_use} vertices that do not exist (the first is triangle {first + 1}, of {len(vertices)} vertices); "
            "the file is damaged or truncated"
        )
    mesh = TriangleMesh(vertices, triangles)
    _check_size(path, mesh)
    return mesh


def _check_size(path: Path, mesh: TriangleMesh) -> None:
    with np.errstate(over="ignore", invalid="ignore"):
        area, size = triangle_areas(mesh).sum(), mesh.diagonal
    farthest = float(np.abs(mesh.vertices[mesh.triangles]).max())
    if not np.isfinite(area) or size > LARGEST:
        raise RefMeshError(f"{path}: its coordinates are too large to compute with (up to {farthest:.1e}); the file is damaged")
    if not area > 0:
        raise RefMeshError(f"{path}: all its triangles have zero area")
    if size < SMALLEST:
        raise RefMeshError(f"{path}: is too small to compute with ({size:.1e} across); export it in another unit")
    if np.spacing(farthest) > LEAST_PRECISION * size:
        raise RefMeshError(
            f"{path}: lies {farthest:.1e} from the origin, where numbers are too coarse for a body {size:.3g} across; "
            "move it to the origin and export it again"
        )
