"""A ball with a layout of six squares, and colors given by a function of place."""

import numpy as np

from refmesh_addon.core.color.appearance import Appearance
from refmesh_addon.core.color.layout import Layout
from refmesh_addon.core.color.texels import Texels
from refmesh_addon.core.types import TriangleMesh


def cube_sphere(count: int, turn: float = 0.0) -> tuple[TriangleMesh, Layout]:
    """Unit sphere of six faces of count x count quads, seams duplicated; each face is a chart in a grid of three by two."""
    steps = np.tan(np.linspace(-1, 1, count + 1) * np.pi / 4)
    s, t = (axis.ravel() for axis in np.meshgrid(steps, steps, indexing="ij"))
    i, j = (axis.ravel() for axis in np.meshgrid(np.arange(count + 1), np.arange(count + 1), indexing="ij"))
    cell = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).ravel()
    quads = np.stack([cell, cell + count + 1, cell + count + 2, cell + 1], axis=1)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    points, uvs, faces = [], [], []
    for face in range(6):
        axis, sign = face % 3, 1 - 2 * (face // 3)
        local = np.stack([sign * s, t, np.ones_like(s)], axis=1) * [1, 1, sign]
        points.append(np.roll(local, axis + 1, axis=1))
        uvs.append(np.stack([(axis + 0.05 + 0.9 * i / count) / 3, (face // 3 + 0.05 + 0.9 * j / count) / 2], axis=1))
        faces.append(triangles + face * len(s))
    vertices = np.concatenate(points)
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    cosine, sine = np.cos(turn), np.sin(turn)
    vertices = vertices @ np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
    return TriangleMesh(vertices, np.concatenate(faces)), Layout(np.concatenate(uvs), np.concatenate(faces))


def smooth_color(points: np.ndarray) -> np.ndarray:
    """(N, 3) uint8, slow waves."""
    return np.rint(127.5 + 100 * np.sin(points * [3.0, 2.0, 4.0] + [0.0, 1.0, 2.0])).astype(np.uint8)


def painted(mesh: TriangleMesh, layout: Layout, size: int, color=smooth_color) -> Appearance:
    """The mesh with a picture whose texels have the color of their place."""
    texels = Texels.of(layout, size)
    image = texels.image(color(texels.points(mesh)))
    count = len(mesh.triangles)
    return Appearance(mesh, layout.corners.astype(np.float32), np.zeros(count, np.int32), np.zeros((count, 3, 3), np.uint8), (image,))
