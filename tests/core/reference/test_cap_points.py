"""Over the holes of the anchor frame: its cap counts once, flaps beyond the rim do not, and what the other frames show wins over a gap."""

import numpy as np
import pytest

from refmesh_addon.core.geometry.mesh import triangle_normals
from refmesh_addon.core.reference.cap_points import HoleFinder, counting
from refmesh_addon.core.reference.oriented_points import oriented_points
from refmesh_addon.core.surfacing.hole_caps import smoothly_capped, without_holes
from refmesh_addon.core.types import TriangleMesh

from ..shapes import box, moved, without

COUNT = 6000


def bottom_of(mesh):
    return triangle_normals(mesh)[:, 2] < -0.9


def points_of(body, finder):
    everything = np.ones(len(body.mesh.triangles), dtype=bool)
    points, normals, triangles = oriented_points(body.mesh, everything, COUNT, np.random.default_rng(0))
    return finder.counted(points, normals, body.holes[triangles] >= 0)


@pytest.fixture(scope="module")
def whole():
    return box((1, 1, 1), subdivisions=3)


@pytest.fixture(scope="module")
def open_below(whole):
    return smoothly_capped(without(whole, bottom_of(whole)))


def test_what_another_frame_shows_beyond_a_rim_does_not_count(whole, open_below):
    longer = TriangleMesh(whole.vertices * [1, 1, 1.2] + [0, 0, -0.1], whole.triangles)  # reaches 0.2 below the cap of the anchor frame
    longer = smoothly_capped(without(longer, bottom_of(longer)))
    finder = HoleFinder(open_below, spacing=0.5)
    own, other = counting([points_of(open_below, finder), points_of(longer, finder)], anchor=0, spacing=0.5)
    assert own.on_cap.any()
    assert not other.on_cap.any()
    assert other.points[:, 2].min() > -0.5 - 1e-9
    assert len(other.points) > 0.6 * COUNT


def test_a_gap_of_the_anchor_frame_is_closed_by_what_the_others_show(whole, open_below):
    finder = HoleFinder(open_below, spacing=0.5)
    lower = without_holes(moved(whole, shift=(0, 0, -0.02)))
    own, *others = counting([points_of(open_below, finder), points_of(lower, finder), points_of(lower, finder)], anchor=0, spacing=0.5)
    assert not own.on_cap.any()
    assert all((other.normals[:, 2] < -0.9).sum() > COUNT / 8 for other in others)


def test_frames_without_holes_count_whole(whole):
    finder = HoleFinder(without_holes(whole), spacing=0.5)
    assert [len(part.points) for part in counting([points_of(without_holes(whole), finder)] * 2, anchor=0, spacing=0.5)] == [COUNT, COUNT]


def test_a_group_of_one_frame_keeps_its_cap(open_below):
    (only,) = counting([points_of(open_below, HoleFinder(open_below, 0.5))], anchor=0, spacing=0.5)
    assert only.on_cap.any()
