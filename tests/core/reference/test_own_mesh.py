"""A mesh of the user's own: what is taken, what is refused and why, and where it goes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.geometry.mesh import submesh
from refmesh_addon.core.reference.group import GroupCenters
from refmesh_addon.core.reference.own_mesh import carried_to_reference, check_own_mesh
from refmesh_addon.core.tracking.affinity import near_pairs
from refmesh_addon.core.types import TriangleMesh

from ..shapes import TILT, ball, inside_out, joined, moved

FRAME = joined(ball(3), ball(3, center=(3.0, 0, 0)))
OWN = joined(ball(2), ball(2, center=(3.0, 0, 0)))


def loose_faces(mesh):
    return TriangleMesh(mesh.vertices[mesh.triangles].reshape(-1, 3), np.arange(mesh.triangles.size).reshape(-1, 3))


def test_meshes_made_over_the_frame_are_taken_open_borders_and_parts_of_it_too():
    check_own_mesh(OWN, FRAME)
    check_own_mesh(submesh(OWN, np.arange(len(OWN.triangles)) >= 100)[0], FRAME)
    check_own_mesh(ball(2), FRAME)


@pytest.mark.parametrize(
    "mesh, reason",
    [
        (moved(OWN, scale=100.0), "as large as the frame"),
        (moved(OWN, scale=0.01), "as large as the frame"),
        (moved(OWN, shift=(0, 8.0, 0)), "of the diagonal or more away"),
        (inside_out(OWN), "faces the other way"),
        (loose_faces(OWN), "loose pieces"),
        (TriangleMesh(np.concatenate([OWN.vertices, [[0, 0, 0]]]), OWN.triangles), "1 of its vertices belong to no face"),
        (TriangleMesh(OWN.vertices, np.concatenate([OWN.triangles, OWN.triangles[:1]])), "more than two faces"),
    ],
)
def test_what_does_not_fit_is_refused_and_why(mesh, reason):
    with pytest.raises(ValueError, match=reason):
        check_own_mesh(mesh, FRAME)


def test_it_goes_where_its_centers_go_with_its_vertices_in_their_order():
    centers = np.stack(np.meshgrid(*[np.linspace(-0.6, 0.6, 4)] * 3), axis=-1).reshape(-1, 3)
    group = GroupCenters(centers, near_pairs(centers, 0.4).weights(), 0.4, 0, 0.0)
    mesh, targets = ball(2), centers @ TILT.T + [1.0, 2, 3]
    carried = carried_to_reference(mesh, centers, targets, group, "affinity")
    assert_allclose(carried.mesh.vertices, mesh.vertices @ TILT.T + [1.0, 2, 3], atol=1e-9)
    assert_array_equal(carried.mesh.triangles, mesh.triangles)
    assert carried.self_intersections == 0
