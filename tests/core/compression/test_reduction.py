import numpy as np

from refmesh_addon.core.compression.reduction import reduced
from refmesh_addon.core.evaluation.sampled_surface import SampledSurface
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.geometry.mesh import is_watertight
from refmesh_addon.core.types import TriangleMesh
from tests.core import shapes


def swelling(mesh, frames):
    return np.stack([mesh.vertices * (1.0 + 0.1 * f) for f in range(frames)])


def test_a_reduced_ball_stays_closed_and_on_the_ball_in_every_frame():
    mesh = shapes.ball(4)
    reduction = reduced(swelling(mesh, 3), mesh.triangles, 600)
    triangles = reduction.triangles
    assert 500 < len(triangles) <= 600
    for index, points in enumerate(reduction.frames):
        coarse = TriangleMesh(points, triangles)
        assert is_watertight(coarse)
        assert SurfaceIndex(coarse).query(mesh.vertices * (1.0 + 0.1 * index)).distances.max() < 0.03 * (1.0 + 0.1 * index)


def test_the_fit_is_closer_than_a_polyhedron_inside():
    """Corners on a ball leave all of the surface inside it; fitted ones lie outside as often as inside."""
    mesh = shapes.ball(4)
    radius = np.linalg.norm(reduced(swelling(mesh, 2), mesh.triangles, 600).frames[1], axis=1)
    assert radius.mean() > 1.101


def test_a_mesh_that_is_small_enough_comes_back():
    mesh = shapes.ball(2)
    reduction = reduced(swelling(mesh, 2), mesh.triangles, 5000)
    np.testing.assert_array_equal(reduction.frames, swelling(mesh, 2))
    np.testing.assert_array_equal(reduction.triangles, mesh.triangles)
    assert reduction.error == 0.0


def test_the_error_is_what_closest_points_measure():
    mesh = shapes.ball(4)
    reduction = reduced(swelling(mesh, 2), mesh.triangles, 600)
    squares = []
    for index, points in enumerate(reduction.frames):
        original = SampledSurface.of(mesh.moved(swelling(mesh, 2)[index]), 20000, np.random.default_rng(index)).points
        squares.append((SurfaceIndex(TriangleMesh(points, reduction.triangles)).query(original).distances ** 2).mean())
    assert 0.9 < reduction.error / np.sqrt(np.mean(squares)) < 1.1
