"""Parts of bodies as one camera sees them, as volumes with a moving border."""

from dataclasses import replace

import numpy as np

from refmesh_addon.core.capture.shell import shell_behind
from refmesh_addon.core.geometry.mesh import submesh, triangle_normals
from refmesh_addon.core.settings import TrackingSettings
from refmesh_addon.core.tracking.volume import Volume, sample_volume
from refmesh_addon.core.types import TriangleMesh

SETTINGS = TrackingSettings(centers=120, resolution=64)


def view(surface: TriangleMesh, thickness: float) -> Volume:
    """The volume of an open surface."""
    volume = sample_volume(shell_behind(surface, thickness), SETTINGS.resolution, SETTINGS.centers)
    return replace(volume, is_view=True)


def sheet(width: float, height: float = 1.0, cell: float = 0.05) -> TriangleMesh:
    """A rectangle in the xy plane from the origin on, facing along z."""
    columns, rows = round(width / cell) + 1, round(height / cell) + 1
    x, y = np.meshgrid(np.linspace(0, width, columns), np.linspace(0, height, rows), indexing="ij")
    number = np.arange(x.size).reshape(x.shape)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    triangles = np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))])
    return TriangleMesh(np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]), triangles)


def seen_along_z(mesh: TriangleMesh) -> TriangleMesh:
    """The triangles that face along z."""
    return submesh(mesh, triangle_normals(mesh)[:, 2] > 0.1)[0]
