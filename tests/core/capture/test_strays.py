"""Stray triangles go before they can spoil any share of the bounding box; bodies stay, however far apart."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.core.capture.cleaning import cleaned
from refmesh_addon.core.capture.diagnosis import FrameStatistics, diagnose
from refmesh_addon.core.capture.strays import without_strays
from refmesh_addon.core.types import TriangleMesh
from tests.core.shapes import ball


def together(*meshes):
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    triangles = [mesh.triangles + start for mesh, start in zip(meshes, starts)]
    return TriangleMesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(triangles))


def moved(mesh, offset, scale=1.0):
    return mesh.moved(mesh.vertices * scale + offset)


TRIANGLE = TriangleMesh(0.1 * np.eye(3), [[0, 1, 2]])
BALL = ball(2)


@pytest.mark.parametrize("distance", [5, 1e3, 1e9])
@pytest.mark.parametrize("size", [1.0, 100.0])
def test_a_far_triangle_goes_however_large_and_far_it_is(distance, size):
    place = (distance + size) * np.array([1.0, -0.5, 0.3])
    mesh, strays = without_strays(together(moved(TRIANGLE, place, size), BALL))
    assert_array_equal(strays, [0])
    assert_array_equal(mesh.vertices, BALL.vertices)


@pytest.mark.parametrize("scale, offset", [(1e-3, 0.0), (1e3, 5e5)])
def test_scale_and_place_do_not_matter(scale, offset):
    both = together(BALL, moved(TRIANGLE, [9.0, 0.0, 0.0]))
    assert_array_equal(without_strays(moved(both, offset, scale))[1], [len(BALL.triangles)])


@pytest.mark.parametrize(
    "mesh",
    [
        BALL,
        together(BALL, moved(BALL, [50.0, 0.0, 0.0])),
        together(ball(3), moved(ball(0), [50.0, 0.0, 0.0])),  # closed: it can be followed
        together(BALL, moved(TRIANGLE, [2.0, 0.0, 0.0])),
        TriangleMesh(BALL.vertices * [100.0, 1.0, 1.0], BALL.triangles),
        TRIANGLE,
    ],
    ids=["one body", "two bodies", "a small closed body", "a near triangle", "a long body", "nothing else"],
)
def test_bodies_and_what_is_near_them_stay(mesh):
    kept, strays = without_strays(mesh)
    assert kept is mesh and not len(strays)


def test_a_spike_of_a_body_goes():
    vertices = ball(3).vertices.copy()
    vertices[7] *= 1e4
    mesh, strays = without_strays(TriangleMesh(vertices, ball(3).triangles))
    assert 5 <= len(strays) <= 6 and mesh.diagonal < 4


def test_a_frame_with_a_stray_has_the_figures_of_one_without_and_the_check_names_it():
    frame = cleaned(together(BALL, moved(TRIANGLE, [1e6, 0.0, 0.0])))
    clean = cleaned(BALL)
    assert_array_equal(frame.mesh.vertices, clean.mesh.vertices)
    assert frame.statistics.diagonal == clean.statistics.diagonal and frame.statistics.strays == 1
    assert_array_equal(np.round(frame.statistics.stray_place), [1e6, 0, 0])
    frames = [FrameStatistics(number, content=str(number), **vars(clean.statistics)) for number in range(4)]
    findings = diagnose([*frames, FrameStatistics(4, content="4", **vars(frame.statistics))])
    assert [(finding.kind, finding.frame) for finding in findings] == [("strays", 4)]
    assert "1 stray triangle is far" in findings[0].message and "1e+06" in findings[0].message
