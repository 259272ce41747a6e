"""A moving torus in two groups, the second with another topology."""

import numpy as np

from refmesh_addon.io.refmesh_stream.writer import FrameGroup
from tests.core import shapes


def torus_groups():
    first, second = shapes.torus(), shapes.ball(2)
    return [FrameGroup((4, 5, 6), waving(first, 3), first.triangles), FrameGroup((8, 9), waving(second, 2), second.triangles)]


def waving(mesh, frames):
    """(F, V, 3): parts of the mesh turn against each other."""
    result = []
    for frame in range(frames):
        angle = 0.2 * frame * mesh.vertices[:, 0]
        y, z = mesh.vertices[:, 1], mesh.vertices[:, 2]
        result.append(np.stack([mesh.vertices[:, 0], y * np.cos(angle) - z * np.sin(angle), y * np.sin(angle) + z * np.cos(angle)], axis=1))
    return np.stack(result)
