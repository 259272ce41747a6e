"""Caps: what they close, what they leave alone, and the volume they give."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.geometry.borders import boundary_edges
from refmesh_addon.core.geometry.holes import capped
from refmesh_addon.core.geometry.mesh import is_watertight, signed_volume
from refmesh_addon.core.types import TriangleMesh

from ..shapes import QUARTER_TURN, TILT, above, ball, box, flipped, joined, moved, torus, without


def random_triangles_missing(mesh, share=0.3):
    return without(mesh, np.random.default_rng(0).random(len(mesh.triangles)) < share)


OPEN_MESHES = {
    "one hole": without(ball(2), above(ball(2), 0.6)),
    "a bowl": without(ball(2), above(ball(2), -0.2)),
    "many holes that touch": random_triangles_missing(ball(2)),
    "a flipped patch": flipped(ball(2), above(ball(2), 0.6)),
    "two open bodies": joined(without(ball(2), above(ball(2), 0.6)), moved(without(torus(), above(torus(), 0.2)), shift=(4, 0, 0))),
    "a lone triangle": TriangleMesh(np.eye(3), [[0, 1, 2]]),
    "three triangles at one edge": TriangleMesh(np.vstack([np.eye(3), [[2, 2, 2], [3, 0, 1]]]), [[0, 1, 2], [0, 1, 3], [1, 0, 4]]),
}
open_meshes = pytest.mark.parametrize("mesh", OPEN_MESHES.values(), ids=OPEN_MESHES.keys())


def boundary_by_loop(mesh):
    """Every directed edge, canceled one by one against an opposite one."""
    left = []
    for a, b, c in mesh.triangles.tolist():
        for edge in ((a, b), (b, c), (c, a)):
            if edge[::-1] in left:
                left.remove(edge[::-1])
            else:
                left.append(edge)
    return sorted(left)


@open_meshes
def test_boundary_same_as_cancelling_edges_one_by_one(mesh):
    assert sorted(map(tuple, boundary_edges(mesh).tolist())) == boundary_by_loop(mesh)


@open_meshes
def test_a_capped_mesh_has_no_boundary(mesh):
    assert len(boundary_edges(mesh))
    assert not len(boundary_edges(capped(mesh)))


@pytest.mark.parametrize("name", ["one hole", "a bowl", "two open bodies"])
def test_simple_holes_become_watertight(name):
    assert is_watertight(capped(OPEN_MESHES[name]))


@open_meshes
def test_the_mesh_itself_comes_first_and_unchanged(mesh):
    result = capped(mesh)
    assert_array_equal(result.vertices[: len(mesh.vertices)], mesh.vertices)
    assert_array_equal(result.triangles[: len(mesh.triangles)], mesh.triangles)


@pytest.mark.parametrize("mesh", [ball(1), box(), torus(), *map(capped, OPEN_MESHES.values())])
def test_a_closed_mesh_is_left_alone(mesh):
    assert capped(mesh) is mesh


def test_flat_holes_get_flat_caps_and_the_whole_volume_back():
    body = box((2.0, 1.0, 0.5), subdivisions=2)
    lidless = moved(without(body, above(body, 0.2)), TILT, (5.0, 6.0, 7.0))
    assert signed_volume(capped(lidless)) == pytest.approx(1.0, rel=1e-12)


def test_many_small_rim_edges_do_not_pull_the_middle_of_a_cap():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    crowded = np.stack([np.linspace(0, 1, 50)[1:-1], np.zeros(48), np.zeros(48)], axis=1)
    rim = np.vstack([corners[:1], crowded, corners[1:]])
    count = len(rim)
    cone = TriangleMesh(np.vstack([rim, [[0.5, 0.5, -1.0]]]), [[(k + 1) % count, k, count] for k in range(count)])
    assert_allclose(capped(cone).vertices[-1], [0.5, 0.5, 0.0], atol=1e-12)


@open_meshes
@pytest.mark.parametrize("change", [{"turn": QUARTER_TURN}, {"scale": 1e-3}, {"scale": 10.0}, {"shift": (100.0, -50.0, 20.0)}])
def test_caps_move_with_the_mesh(mesh, change):
    result, expected = capped(moved(mesh, **change)), moved(capped(mesh), **change)
    assert_array_equal(result.triangles, expected.triangles)
    assert_allclose(result.vertices, expected.vertices, rtol=1e-12, atol=1e-12)
