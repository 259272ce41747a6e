"""Triangles of the mesh formats that trimesh reads."""

from __future__ import annotations

import io
from collections.abc import Callable

import numpy as np


def parse_with_trimesh(data: bytes, kind: str, check: Callable[[bytes], None] = lambda data: None) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) and triangles (T, 3) of all objects of a file, each in its place; polygons are triangulated.

    kind : extension without the dot.  check : raises ValueError for a file that is cut off, where trimesh would not.
    Raises whatever trimesh raises for a damaged file.
    """
    import trimesh  # late, so that discovery and OBJ work where it is missing, and the message is readable

    check(data)
    scene = trimesh.load_scene(io.BytesIO(data), file_type=kind, process=False, skip_materials=True)
    vertices, triangles, count = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int64)], 0
    for node in scene.graph.nodes_geometry:
        transform, name = scene.graph[node]
        mesh = scene.geometry[name]
        if isinstance(mesh, trimesh.Trimesh):
            mirrored = np.linalg.det(transform[:3, :3]) < 0
            vertices.append(mesh.vertices @ transform[:3, :3].T + transform[:3, 3])
            triangles.append((mesh.faces[:, ::-1] if mirrored else mesh.faces) + count)
            count += len(mesh.vertices)
    return np.concatenate(vertices), np.concatenate(triangles)
