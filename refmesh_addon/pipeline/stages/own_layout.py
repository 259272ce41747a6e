"""UV maps of the user's own as the texture layouts of reference meshes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ...core.color.layout import Layout
from ...core.color.own_layout import layout_of
from ...core.errors import RefMeshError
from ...core.reference.group import ReferenceMesh
from ...core.types import TriangleMesh
from ...io.own_uvs import OWN_LAYOUT_NAME, own_uvs, read_own_layout
from ..session.context import Context
from .own_mesh import own_mesh

REFUSED = "its UV map cannot hold the colors"


def own_layouts(context: Context, references: Mapping[int, ReferenceMesh]) -> dict[int, Layout]:
    """By index of the group: the UV map added to its mesh in Blender, else that of the mesh of `--mesh`.

    Warns of those that cannot be used.
    """
    given, result = _of_own_mesh(context), {}
    for index, reference in references.items():
        added = _added(context, index, reference.mesh)
        if added is not None:
            result[index] = added
        elif given is not None and np.array_equal(given[0], reference.mesh.triangles):
            result[index] = given[1]
    return result


def _added(context: Context, index: int, mesh: TriangleMesh) -> Layout | None:
    path = context.output / OWN_LAYOUT_NAME.format(index)
    if not path.is_file():
        return None
    try:
        triangles, uvs = read_own_layout(path)
        if np.array_equal(triangles, mesh.triangles):
            return layout_of(uvs)
        context.warn(f"group {index}: its UV map in Blender is of another topology; run Color once more to use what was carried over")
    except (OSError, ValueError, RefMeshError) as error:
        context.warn(f"group {index}: {REFUSED}: {error}; another layout is computed")
    return None


def _of_own_mesh(context: Context) -> tuple[np.ndarray, Layout] | None:
    """Triangles (T, 3) of the mesh of `--mesh` and its UV map; None where there is none, or, with a warning, one that cannot be used."""
    path = context.settings.reference.mesh
    if not path:
        return None
    try:
        triangles, uvs = own_mesh(context).triangles, own_uvs(Path(path))
        if uvs is None or len(uvs) != len(triangles):
            return None
        return triangles, layout_of(uvs)
    except (OSError, ValueError, RefMeshError) as error:
        context.warn(f"{path}: {REFUSED}: {error}; another layout is computed")
        return None
