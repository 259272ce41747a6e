"""Places at which two surfaces are far apart: each connected part once, the worst first, without what no camera saw."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from refmesh_addon.core.evaluation.far_places import FAR, MOST, missing_places
from refmesh_addon.core.evaluation.metrics import measure
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.types import TriangleMesh
from tests.core.shapes import ball, box, joined


def moved(mesh, offset):
    return mesh.moved(mesh.vertices + offset)


def test_a_part_that_only_the_result_has_is_extra_and_one_that_only_the_source_has_is_missing():
    body, part = ball(3), moved(ball(2, 0.2), [3.0, 0, 0])
    result = measure(body, joined(body, part), 2000)
    assert len(result.extra.distances) == 1 and not len(result.missing.distances)
    assert_allclose(result.extra.positions[0], [3.2, 0, 0], atol=0.01)
    assert_allclose(result.extra.distances[0], 2.2 / body.diagonal, rtol=0.01)
    assert_allclose(result.extra.areas[0], 0.04 / 1.04, rtol=0.05)
    result = measure(joined(body, part), body, 2000)
    assert len(result.missing.distances) == 1 and not len(result.extra.distances)
    assert_allclose(result.missing.positions[0], [3.2, 0, 0], atol=0.01)


def test_each_part_is_one_place_and_the_worst_is_first():
    body = ball(3)
    parts = [moved(ball(1, 0.1), [x, 0, 0]) for x in (2.0, -3.0, 2.5)]
    extra = measure(body, joined(body, *parts), 2000).extra
    assert_allclose(extra.positions[:, 0], [-3.1, 2.6, 2.1], atol=0.02)
    assert (np.diff(extra.distances) < 0).all()


def test_a_single_vertex_that_sticks_out_is_a_place_however_few_samples_there_are():
    body = ball(4)
    spiky = body.vertices.copy()
    spiky[7] *= 1.0 + 1.5 * FAR * body.diagonal
    extra = measure(body, body.moved(spiky), 100).extra
    assert_allclose(extra.positions, spiky[[7]])
    assert not len(measure(body, body, 100).extra.distances)


def test_what_is_smaller_than_half_an_edge_of_the_result_is_not_missing():
    sides = (2.0, 1.0, 1.0)
    source = box(sides, 4)
    top = np.flatnonzero(source.vertices[:, 2] == source.vertices[:, 2].max())[10]
    source = source.moved(source.vertices + np.eye(len(source.vertices))[top][:, None] * [0.0, 0.0, 1.5 * FAR * source.diagonal])
    assert not len(missing_places(SurfaceIndex(source), SurfaceIndex(box(sides, 2))).distances)
    assert_allclose(missing_places(SurfaceIndex(source), SurfaceIndex(box(sides, 5))).positions, source.vertices[[top]])


def test_the_walls_of_a_contact_are_no_place():
    halves = [box((1.0, 1.0, 1.0), 6, (sign * 0.5, 0.0, 0.0)) for sign in (-1, 1)]
    source = box((2.0, 1.0, 1.0), 6)
    assert not len(measure(source, joined(*halves), 2000).extra.distances)


def test_the_cap_of_a_hole_is_no_place():
    whole = ball(4)
    open_ball = TriangleMesh(whole.vertices, whole.triangles[whole.vertices[whole.triangles].mean(axis=1)[:, 2] < 0.8])
    assert not len(measure(open_ball, whole, 2000).extra.distances)


def test_only_the_worst_are_kept():
    body = ball(2)
    debris = [moved(ball(0, 0.05), [2.0 + 0.3 * index, 0, 0]) for index in range(MOST + 3)]
    extra = measure(body, joined(body, *debris), 500).extra
    assert len(extra.distances) == MOST
    assert extra.positions[0, 0] > 2.0 + 0.3 * (MOST + 2)


@pytest.mark.parametrize("scale", [0.001, 1000.0])
def test_scale_changes_nothing(scale):
    meshes = ball(3), joined(ball(3), moved(ball(1, 0.2), [3.0, 0, 0]))
    one, other = measure(*meshes, 500).extra, measure(*(mesh.moved(scale * mesh.vertices) for mesh in meshes), 500).extra
    assert_allclose(other.distances, one.distances)
    assert_allclose(other.positions, scale * one.positions)
