"""Meshes in and out: one reader for every format, with the checks that every stage relies on."""

from __future__ import annotations

import io
import struct
from pathlib import Path

import numpy as np

from ..core.errors import RefMeshError
from ..core.geometry.mesh import merged, triangle_areas
from ..core.types import TriangleMesh
from .cut_off import check_complete
from .files import atomic_file
from .obj import parse_obj

# What trimesh raises on files that are not what their name says (NameError: a variable that only sound files set).
_GARBLED = (
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    NameError,
    ArithmeticError,
    AssertionError,
    NotImplementedError,
    EOFError,
    struct.error,
)


def read_mesh(path: str | Path) -> TriangleMesh:
    """The triangles of a mesh file (.obj .ply .stl .glb .off), in the file's own coordinates.

    Polygons are triangulated, all objects of a scene are taken together in their places, and everything but geometry
    is ignored. Duplicated vertices along UV seams, unused vertices, holes and floating parts are left as they are;
    only STL, which knows no shared vertices, is merged.
    Raises RefMeshError, naming the file, when it cannot be read, is empty or cut off, has coordinates that are not
    finite, triangles whose vertices do not exist, no triangles, or no area.
    """
    path = Path(path)
    return parse_mesh(read_bytes(path), path)


def read_bytes(path: str | Path) -> bytes:
    """All bytes of an input file. Raises RefMeshError, naming it, when it cannot be read or is empty."""
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise RefMeshError(f"{path}: cannot be read ({error.strerror or error})") from error
    if not data.strip():
        raise RefMeshError(f"{path}: the file is empty; export this frame again")
    return data


def parse_mesh(data: bytes, path: str | Path) -> TriangleMesh:
    """What `read_mesh` does, for the bytes of a file that were read already; `path` gives format and messages."""
    path = Path(path)
    kind = path.suffix.lower().removeprefix(".")
    try:
        vertices, triangles = parse_obj(data) if kind == "obj" else _parse_with_trimesh(data, kind)
    except _GARBLED as error:
        words = str(error).partition("\n")[0] or type(error).__name__
        raise RefMeshError(f"{path}: cannot be read as {kind.upper()}: {words}") from error
    mesh = _checked(path, vertices, triangles)
    return merged(mesh)[0] if kind == "stl" else mesh


def write_ply(path: str | Path, mesh: TriangleMesh, colors: np.ndarray | None = None, velocities: np.ndarray | None = None) -> None:
    """Binary PLY in double precision (single is too coarse far from the origin), vertices and triangles in their order.

    colors : (V, 4) uint8, red, green, blue and alpha of each vertex.  velocities : (V, 3) written as float32 vx, vy and vz.
    The same mesh gives the same bytes. Raises RefMeshError when the file cannot be written.
    """
    count = len(mesh.vertices)
    if colors is not None and (colors.shape != (count, 4) or colors.dtype != np.uint8):
        raise ValueError(f"colors must be ({count}, 4) uint8; got {colors.shape} {colors.dtype}")
    if velocities is not None and velocities.shape != (count, 3):
        raise ValueError(f"velocities must be ({count}, 3); got {velocities.shape}")
    columns: list[tuple[str, str, tuple[str, ...], np.ndarray]] = [("double", "<f8", ("x", "y", "z"), mesh.vertices)]
    columns += [] if colors is None else [("uchar", "u1", ("red", "green", "blue", "alpha"), colors)]
    columns += [] if velocities is None else [("float", "<f4", ("vx", "vy", "vz"), velocities)]
    rows = np.empty(count, dtype=[(names[0], kind, len(names)) for _, kind, names, _ in columns])
    for _, _, names, values in columns:
        rows[names[0]] = values
    faces = np.empty(len(mesh.triangles), dtype=[("corners", "u1"), ("indices", "<i4", 3)])
    faces["corners"], faces["indices"] = 3, mesh.triangles
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {count}"]
    header += [f"property {word} {name}" for word, _, names, _ in columns for name in names]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", ""]
    with atomic_file(path) as file:
        file.write("\n".join(header).encode("ascii"))
        file.write(rows.tobytes())
        file.write(faces.tobytes())


def _parse_with_trimesh(data: bytes, kind: str) -> tuple[np.ndarray, np.ndarray]:
    import trimesh  # late, so that discovery and OBJ work, and the message is in words, where it is missing

    check_complete(data, kind)
    scene = trimesh.load_scene(io.BytesIO(data), file_type=kind, process=False, skip_materials=True)
    vertices, triangles, count = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int64)], 0
    for node in scene.graph.nodes_geometry:
        transform, name = scene.graph[node]
        part = scene.geometry[name]
        if isinstance(part, trimesh.Trimesh):
            mirrored = np.linalg.det(transform[:3, :3]) < 0
            vertices.append(part.vertices @ transform[:3, :3].T + transform[:3, 3])
            triangles.append((part.faces[:, ::-1] if mirrored else part.faces) + count)
            count += len(part.vertices)
    return np.concatenate(vertices), np.concatenate(triangles)


def _checked(path: Path, vertices: np.ndarray, triangles: np.ndarray) -> TriangleMesh:
    if not len(triangles):
        raise RefMeshError(f"{path}: holds no triangles; export this frame as a surface")
    finite = np.isfinite(vertices).all(axis=1)
    if not finite.all():
        count, first = np.count_nonzero(~finite), int(np.argmin(finite))
        raise RefMeshError(f"{path}: {count} vertices have coordinates that are not finite numbers (the first is vertex {first + 1})")
    outside = ((triangles < 0) | (triangles >= len(vertices))).any(axis=1)
    if outside.any():
        count, first = np.count_nonzero(outside), int(np.argmax(outside))
        raise RefMeshError(
            f"{path}: {count} triangles use vertices that do not exist (the first is triangle {first + 1}, of {len(vertices)} vertices); "
            "the file is damaged or cut off"
        )
    mesh = TriangleMesh(vertices, triangles)
    area = triangle_areas(mesh).sum()
    if not area > 0:
        raise RefMeshError(f"{path}: all its triangles have zero area")
    return mesh
