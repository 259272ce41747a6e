"""What no camera saw, from the two surfaces alone: contacts and holes, and nothing else."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.core.evaluation import visibility
from refmesh_addon.core.evaluation.metrics import surface_distance
from refmesh_addon.core.evaluation.sampled_surface import SampledSurface
from refmesh_addon.core.evaluation.visibility import in_contact
from refmesh_addon.core.geometry.borders import border_edges, on_border
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.geometry.holes import capped
from refmesh_addon.core.geometry.winding import enclosed_by
from refmesh_addon.core.types import TriangleMesh
from tests.core.shapes import ball, box, joined


def two_boxes(overlap):
    """Cubes of side 1 side by side along x; they run into each other by `overlap`."""
    return joined(*(box((1.0,) * 3, 4, (sign * (0.5 - overlap / 2), 0.0, 0.0)) for sign in (-1, 1)))


def seen_from_outside(overlap):
    return box((2.0 - overlap, 1.0, 1.0), 4)


def sampled(mesh):
    return SampledSurface.of(mesh, 4000, np.random.default_rng(0))


def contact(mesh, source):
    samples = sampled(mesh)
    depths = np.where(enclosed_by(source)(samples.points), SurfaceIndex(source).query(samples.points).distances, 0.0)
    return samples.points, in_contact(SurfaceIndex(mesh), samples, depths)


def over_hole(source, points):
    caps = TriangleMesh(capped(source).vertices, capped(source).triangles[len(source.triangles) :])
    index = SurfaceIndex(source)
    return visibility.over_hole(index, caps, points, index.query(points))


@pytest.mark.parametrize("overlap", [0.0, 0.04, 0.3])
def test_the_faces_that_touch_are_in_contact_and_the_others_are_not(overlap):
    points, marked = contact(two_boxes(overlap), seen_from_outside(overlap))
    x, y, z = np.abs(points).T
    between = (x < overlap / 2 + 1e-9) & (np.maximum(y, z) < 0.5 - 1e-9)
    assert between.sum() > 300
    assert marked[between].all()
    assert not marked[~between].any()


def test_the_end_of_a_narrow_slit_is_in_contact():
    """A box with a slit that the source does not show: its walls face each other, its end faces only the way out."""
    width, depth = 0.02, 0.4
    halves = [box((1.0, 0.5 - width / 2, 1.0), 4, (0.0, sign * (0.25 + width / 4), 0.0)) for sign in (-1, 1)]
    slit = joined(*halves, box((1.0 - depth, width, 1.0), 4, (-depth / 2, 0.0, 0.0)))
    points, marked = contact(slit, box((1.0, 1.0, 1.0), 4))
    end = (np.abs(points[:, 1]) < width / 2) & (points[:, 0] > -depth) & (np.abs(points[:, 2]) < 0.45) & (points[:, 0] < 0.45)
    assert end.sum() > 5
    assert marked[end].all()


def test_a_thin_sheet_that_misses_its_source_is_not_in_contact():
    thin, source = box((1.0, 1.0, 0.02), 5), box((1.0, 1.0, 0.03), 5)
    assert not contact(thin, source)[1].any()


def test_a_surface_that_is_too_small_is_all_seen():
    small, source = ball(3), ball(3)
    small = small.moved(0.9 * small.vertices)
    result = surface_distance(source, small, 2000, np.random.default_rng(0))
    assert result.unseen == 0
    assert result.visible_to_source == result.deformed_to_source


def test_over_a_hole_is_what_lies_where_the_capture_is_open():
    whole = ball(4)
    top = (whole.vertices[whole.triangles][:, :, 2] > 0.8).all(axis=1)
    points = sampled(whole).points
    source = TriangleMesh(whole.vertices, whole.triangles[~top])
    marked = over_hole(source, points)
    beyond = points + [0.0, 0.0, 0.2] * (points[:, 2:] > 0.8)  # above the rim; below what closes the hole lies nothing but that
    assert over_hole(source, beyond)[points[:, 2] > 0.81].all()
    assert marked[points[:, 2] > 0.9].all() and not marked[points[:, 2] < 0.6].any()
    assert_array_equal(over_hole(whole, points), np.zeros(len(points), dtype=bool))


def test_the_nearest_point_of_the_closed_source_tells_the_same():
    """A slow twin: the source and what closes its holes searched as one surface."""
    whole = ball(4)
    low = (whole.vertices[whole.triangles][:, :, 2] < -0.7).all(axis=1)
    source = TriangleMesh(whole.vertices, whole.triangles[~low])
    points = 1.3 * sampled(whole).points
    nearest = SurfaceIndex(capped(source)).query(points)
    own = nearest.triangles < len(source.triangles)
    rim = np.zeros(len(points), dtype=bool)
    rim[own] = on_border(source, border_edges(source), nearest.triangles[own], nearest.points[own])
    assert 0 < (rim & own).sum() < (rim | ~own).sum() < len(points)
    assert_array_equal(over_hole(source, points), rim | ~own)


def test_figures_leave_out_a_contact_and_say_how_much():
    mesh, source = two_boxes(0.0), seen_from_outside(0.0)
    result = surface_distance(source, mesh, 5000, np.random.default_rng(0))
    assert result.unseen == pytest.approx(2 / 12, abs=0.02)
    assert result.deformed_to_source.max > 0.1
    assert result.visible_to_source.max < 1e-6
