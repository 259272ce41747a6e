"""Triangles of the mesh formats that trimesh reads."""

from __future__ import annotations

import io
from collections.abc import Callable

import numpy as np

from .polygons import ParsedMesh

# Triangles that the objects of a scene may have together where some are placed more than once.
MOST_INSTANCED = 4_000_000


def parse_with_trimesh(data: bytes, kind: str, check: Callable[[bytes], None]) -> ParsedMesh:
    """Vertices and triangles of all objects of a file, each in its place; polygons are triangulated.

    kind : extension without the dot.  check : raises ValueError for a file that trimesh should not be given.
    Raises ValueError, with what trimesh says, for a damaged file.
    """
    check(data)
    scene = load_scene(data, kind, skip_materials=True)
    parts = placed_meshes(scene)
    vertices = [np.empty((0, 3)), *(part.vertices @ transform[:3, :3].T + transform[:3, 3] for part, transform in parts)]
    starts = np.cumsum([0] + [len(part.vertices) for part, _ in parts])
    triangles = [outward_faces(part, transform) + start for (part, transform), start in zip(parts, starts, strict=False)]
    return ParsedMesh(np.concatenate(vertices), np.concatenate([np.empty((0, 3), dtype=np.int64), *triangles]))


def load_scene(data: bytes, kind: str, **options):
    """trimesh's scene of a file. Raises ValueError, with what trimesh says, when it cannot be read."""
    import trimesh  # late, so that discovery and OBJ work where it is missing, and the message is readable

    try:
        return trimesh.load_scene(io.BytesIO(data), file_type=kind, process=False, **options)
    except (MemoryError, RecursionError):
        raise
    except Exception as error:  # the edge of the library: damaged files make it raise anything
        raise ValueError(str(error) or type(error).__name__) from error


def placed_meshes(scene) -> list[tuple]:
    """The meshes of a trimesh scene and the (4, 4) transform of each. Raises ValueError when instances would fill the memory."""
    import trimesh

    placed = [(scene.geometry[name], transform) for transform, name in (scene.graph[node] for node in scene.graph.nodes_geometry)]
    parts = [(part, transform) for part, transform in placed if isinstance(part, trimesh.Trimesh)]
    total = sum(max(len(part.faces), len(part.vertices)) for part, _ in parts)
    if total > MOST_INSTANCED and len({id(part) for part, _ in parts}) < len(parts):
        raise ValueError(f"its objects, placed several times, have {total} triangles together, more than {MOST_INSTANCED}")
    return parts


def outward_faces(part, transform: np.ndarray) -> np.ndarray:
    """(T, 3) corners of a placed mesh, turned where the transform mirrors it."""
    mirrored = np.linalg.det(transform[:3, :3]) < 0
    return np.asarray(part.faces[:, ::-1] if mirrored else part.faces, dtype=np.int64)
