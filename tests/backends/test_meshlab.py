"""PyMeshLab's work on known surfaces, done in another process: imported here it would break a later import of bpy."""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.backends import meshlab
from refmesh_addon.core.check import RefMeshError
from refmesh_addon.core.closest_point import SurfaceIndex
from refmesh_addon.core.geometry import (
    is_watertight,
    mean_edge_length,
    sample_surface,
    signed_volume,
    triangle_areas,
    triangle_normals,
    vertex_components,
)
from refmesh_addon.core.types import TriangleMesh

DEPTH = 5
BODIES = {
    "ball": trimesh.creation.icosphere(3),
    "torus": trimesh.creation.torus(1.0, 0.4),
    "two balls": trimesh.util.concatenate(
        [trimesh.creation.icosphere(3), trimesh.creation.icosphere(3, 0.5).apply_translation([2.0, 0, 0])]
    ),
}
BODIES = {name: TriangleMesh(np.asarray(shape.vertices), np.asarray(shape.faces)) for name, shape in BODIES.items()}
bodies = pytest.mark.parametrize("body", BODIES.values(), ids=BODIES.keys())


@pytest.fixture(scope="module")
def apart():
    """apart(function, *arguments): the result of a function that ran in a process of its own."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as process:
        yield lambda function, *arguments: process.submit(function, *arguments).result()


def oriented_points(body, count=4000):
    points, triangles = sample_surface(body, count, np.random.default_rng(0))
    return points, triangle_normals(body)[triangles]


def distance(mesh, body):
    """Mean distance both ways."""
    points = [sample_surface(surface, 2000, np.random.default_rng(0))[0] for surface in (mesh, body)]
    return max(SurfaceIndex(mesh).query(points[1]).distances.mean(), SurfaceIndex(body).query(points[0]).distances.mean())


@bodies
def test_a_reconstruction_is_closed_faces_outward_and_lies_on_the_points(apart, body):
    found = apart(meshlab.screened_poisson, *oriented_points(body), DEPTH)
    cell = 1.1 * np.ptp(body.vertices, axis=0).max() / 2**DEPTH
    assert is_watertight(found)
    assert vertex_components(found)[0] == vertex_components(body)[0]
    assert signed_volume(found) == pytest.approx(signed_volume(body), rel=0.02)
    assert distance(found, body) < 0.1 * cell
    assert apart(meshlab.self_intersections, found) == 0


def test_points_that_face_inward_give_an_inside_out_surface(apart):
    points, normals = oriented_points(BODIES["ball"])
    assert signed_volume(apart(meshlab.screened_poisson, points, -normals, DEPTH)) < 0


def test_depth_refines_about_fourfold(apart):
    coarse, fine = (len(apart(meshlab.screened_poisson, *oriented_points(BODIES["torus"], 8000), depth).triangles) for depth in (4, 5))
    assert 3 < fine / coarse < 5


@pytest.mark.parametrize(("scale", "shift"), [(1e-3, 0.0), (10.0, 0.0), (1.0, 1e5)])
def test_a_reconstruction_scales_and_moves_with_its_points(apart, scale, shift):
    points, normals = oriented_points(BODIES["torus"])
    plain = apart(meshlab.screened_poisson, points, normals, DEPTH)
    found = apart(meshlab.screened_poisson, scale * points + shift, normals, DEPTH)
    assert_array_equal(found.triangles, plain.triangles)
    assert_allclose(found.vertices, scale * plain.vertices + shift, atol=1e-7 * scale)


def test_the_same_points_give_the_same_bytes(apart):
    first, again = (apart(meshlab.screened_poisson, *oriented_points(BODIES["two balls"]), DEPTH) for _ in range(2))
    assert_array_equal(first.vertices, again.vertices)
    assert_array_equal(first.triangles, again.triangles)
    first, again = (apart(meshlab.remeshed, first, 800) for _ in range(2))
    assert_array_equal(first.vertices, again.vertices)
    assert_array_equal(first.triangles, again.triangles)


@bodies
@pytest.mark.parametrize("triangles", [600, 3000])
def test_remeshing_keeps_the_surface_and_meets_the_budget(apart, body, triangles):
    found = apart(meshlab.remeshed, body, triangles)
    assert len(found.triangles) == pytest.approx(triangles, abs=2)
    assert is_watertight(found)
    assert vertex_components(found)[0] == vertex_components(body)[0]
    assert distance(found, body) < 0.1 * mean_edge_length(found)
    assert signed_volume(found) == pytest.approx(signed_volume(body), rel=0.07)
    assert apart(meshlab.self_intersections, found) == 0


def test_remeshed_triangles_are_even_and_well_shaped(apart):
    shape = BODIES["torus"]
    stretched = shape.moved(shape.vertices * [4.0, 1.0, 1.0])  # slivers
    found = apart(meshlab.remeshed, stretched, 2000)
    sides = np.linalg.norm(np.diff(found.vertices[found.triangles[:, [0, 1, 2, 0]]], axis=1), axis=2)
    roundness = 4 * np.sqrt(3) * triangle_areas(found) / (sides**2).sum(axis=1)  # 1 for a regular triangle
    assert np.median(roundness) > 0.8
    assert np.percentile(roundness, 1) > 0.2


def test_crossing_triangles_are_counted(apart):
    ball = BODIES["ball"]
    shifted = ball.moved(ball.vertices + [1.0, 0, 0])
    both = TriangleMesh(np.vstack([ball.vertices, shifted.vertices]), np.vstack([ball.triangles, ball.triangles + len(ball.vertices)]))
    assert apart(meshlab.self_intersections, ball) == 0
    assert 20 < apart(meshlab.self_intersections, both) < len(both.triangles) // 2


def test_points_that_give_no_surface_are_refused_in_words(apart):
    with pytest.raises(RefMeshError, match="came out empty"):
        apart(meshlab.screened_poisson, np.random.default_rng(0).random((5, 3)), np.ones((5, 3)), DEPTH)


@pytest.mark.parametrize("scale", [1e-3, 10.0])
def test_remeshing_has_no_unit(apart, scale):
    body = BODIES["two balls"]
    plain, found = apart(meshlab.remeshed, body, 600), apart(meshlab.remeshed, body.moved(scale * body.vertices), 600)
    assert len(found.triangles) == len(plain.triangles)
    assert distance(found.moved(found.vertices / scale), plain) < 0.1 * mean_edge_length(plain)
