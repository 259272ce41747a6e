"""Bodies of the mesh that a frame does not show are in one point of the rest there; all others stay as they are."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.core.deformation.presence import OUT_OF_VIEW, absent_bodies, shrunk
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.geometry.mesh import triangle_areas
from refmesh_addon.core.geometry.winding import enclosed_by, nothing_enclosed_by
from refmesh_addon.core.types import TriangleMesh
from tests.core.shapes import ball, box, joined

BODY = box((2.0, 1.2, 0.8), 4)


def absent(mesh, source):
    return absent_bodies(mesh, SurfaceIndex(source), enclosed_by(source))


def prop(x):
    return ball(2, 0.2, (x, 0.0, 0.0))


def test_a_body_that_the_frame_shows_is_present_and_one_that_it_does_not_show_is_absent():
    both = joined(BODY, prop(2.0))
    assert not absent(both, both).any()
    assert_array_equal(absent(both, BODY), np.arange(len(both.vertices)) >= len(BODY.vertices))


def test_what_a_camera_sees_of_a_body_is_not_lost():
    both, seen = joined(BODY, prop(2.0)), prop(2.0).triangles[prop(2.0).vertices[prop(2.0).triangles][:, :, 0].max(axis=1) > 2.1]
    source = joined(BODY, TriangleMesh(prop(2.0).vertices, seen))
    arguments = both, SurfaceIndex(source), nothing_enclosed_by(source)
    assert absent_bodies(*arguments).any() and not absent_bodies(*arguments, OUT_OF_VIEW).any()
    assert absent_bodies(both, SurfaceIndex(BODY), nothing_enclosed_by(BODY), OUT_OF_VIEW).any()


def test_a_body_inside_another_is_hidden_and_not_absent():
    assert not absent(joined(BODY, prop(0.0)), BODY).any()


def test_a_body_that_is_only_half_covered_by_a_hole_is_present():
    whole = joined(BODY, prop(2.0))
    opened = whole.vertices[whole.triangles].mean(axis=1)[:, 0] < 2.05
    source = type(whole)(whole.vertices, whole.triangles[opened])
    assert not absent(whole, source).any()


def test_something_always_remains():
    assert not absent(joined(BODY, prop(2.0)), ball(2, 1.0, (50.0, 0, 0)))[: len(BODY.vertices)].any()


@pytest.mark.parametrize("x, end", [(3.0, 1.0), (-3.0, -1.0)])
def test_an_absent_body_has_no_area_and_lies_on_the_nearest_of_the_rest(x, end):
    mesh = joined(BODY, prop(x))
    gone = absent(mesh, BODY)
    placed = shrunk(mesh.vertices, mesh, gone)
    assert_array_equal(placed[~gone], mesh.vertices[~gone])
    assert len(np.unique(placed[gone], axis=0)) == 1 and placed[gone][0, 0] == end
    assert triangle_areas(mesh.moved(placed))[gone[mesh.triangles[:, 0]]].max() == 0.0
    assert shrunk(mesh.vertices, mesh, np.zeros(len(gone), bool)) is mesh.vertices
