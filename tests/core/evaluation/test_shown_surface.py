"""Which vertices a frame shows, and distances over these alone."""

import numpy as np
import pytest

from refmesh_addon.core.evaluation.open_metrics import measure_open
from refmesh_addon.core.evaluation.shown_surface import median_of_three, shown_vertices
from refmesh_addon.core.types import TriangleMesh

from ..capture.test_depth_artifacts import sheet
from ..shapes import TILT, inside_out, moved

WHOLE = sheet(40)
HALF = sheet(40, cut=[(row, column) for row in range(20, 40) for column in range(40)])  # ends at x = 1/2


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_vertices_are_shown_up_to_the_border_of_the_frame(scale):
    deformed, source = (moved(mesh, TILT, scale=scale) for mesh in (WHOLE, HALF))
    visibility = shown_vertices(deformed, source).visibility
    x = WHOLE.vertices[:, 0]
    assert (visibility[x < 0.45] > 0.99).all() and (visibility[x > 0.56] < 0.01).all()
    assert visibility.dtype == np.float32 and 0 <= visibility.min() and visibility.max() <= 1


def test_what_lies_behind_or_faces_away_is_not_shown():
    behind = WHOLE.moved(WHOLE.vertices - [0, 0, 0.2])
    assert not shown_vertices(behind, WHOLE).visibility.any()
    assert not shown_vertices(inside_out(WHOLE), WHOLE).visibility.any()


def test_distances_are_from_what_was_kept_and_from_what_is_shown():
    distances = measure_open(WHOLE, HALF, WHOLE, shown_vertices(WHOLE, HALF).visibility, 5000).distances
    assert distances.kept == pytest.approx(0.5, abs=0.01)
    assert distances.source_to_deformed.max < 1e-6 and distances.visible_to_source.max * WHOLE.diagonal < 1.1 / 40
    assert distances.deformed_to_source.max * WHOLE.diagonal == pytest.approx(0.5, abs=0.01)
    assert distances.unseen == pytest.approx(0.5, abs=0.05)


def test_the_distance_of_borders_is_their_own():
    shorter = sheet(40, cut=[(row, column) for row in range(30, 40) for column in range(40)])  # ends at x = 3/4
    distances = measure_open(WHOLE, WHOLE, shorter, np.ones(len(shorter.vertices)), 2000).distances
    assert distances.border.max * WHOLE.diagonal == pytest.approx(0.25, abs=0.01)
    same = measure_open(WHOLE, WHOLE, WHOLE, np.ones(len(WHOLE.vertices)), 2000).distances
    assert same.border.max < 1e-9
    closed = TriangleMesh(WHOLE.vertices, np.concatenate([WHOLE.triangles, WHOLE.triangles[:, ::-1]]))
    assert measure_open(closed, closed, WHOLE, np.ones(len(WHOLE.vertices)), 2000).distances.border is None


def test_the_corners_of_triangles_that_span_a_gap_of_the_source_are_not_shown():
    right = WHOLE.vertices[:, 0] > 0.5
    apart = WHOLE.moved(WHOLE.vertices + right[:, None] * [0.5, 0, 0])
    spanning = np.ptp(right[apart.triangles].astype(int), axis=1) > 0
    visibility = shown_vertices(apart, TriangleMesh(apart.vertices, apart.triangles[~spanning])).visibility
    corners = np.unique(apart.triangles[spanning])
    assert not visibility[corners].any() and (visibility[np.abs(WHOLE.vertices[:, 0] - 0.5) > 0.1] > 0.99).all()


def test_a_change_that_lasts_one_frame_is_left_out_and_one_that_lasts_stays():
    flicker, lasting = np.array([1.0, 1, 0, 1, 1]), np.array([0.0, 0, 0.4, 1, 1])
    steady = lambda row: median_of_three(row[:-2], row[1:-1], row[2:])
    assert steady(flicker).tolist() == [1, 1, 1] and steady(lasting).tolist() == [0, 0.4, 1]
    rows = np.random.default_rng(0).random((3, 50))
    np.testing.assert_array_equal(median_of_three(*rows), np.median(rows, axis=0))
