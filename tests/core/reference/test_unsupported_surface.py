"""A reconstruction that lies nowhere near the frames ends in a message, not in a loop."""

import pytest
import trimesh

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.reference.group import build_reference
from refmesh_addon.core.types import TriangleMesh


@pytest.mark.parametrize("offset", [1e15, 1e3])
def test_a_surface_far_from_the_points_is_refused(offset):
    ball = trimesh.creation.icosphere(subdivisions=1)
    elsewhere = TriangleMesh(ball.vertices + offset, ball.faces)
    with pytest.raises(RefMeshError, match="no surface near the aligned frames"):
        build_reference(ball.vertices, ball.vertex_normals, 0.1, 100, 4, lambda *_: elsewhere)
