"""What the frames of an open take have in common."""

import numpy as np
import pytest

from refmesh_addon.core.capture.cleaning import cleaned
from refmesh_addon.core.capture.depth_artifacts import depth_artifacts
from refmesh_addon.core.capture.open_take import open_take
from refmesh_addon.core.capture.openness import CLOSED, LAYER, OPEN, surface_kind, take_kind
from refmesh_addon.core.geometry.mesh import area_vectors, is_watertight, signed_volume

from ..shapes import above, ball, box, inside_out, joined, moved, without

HALF = without(ball(), ~above(ball(), 0.0))


def facts(*meshes):
    frames = [cleaned(mesh) for mesh in meshes]
    return [(frame.facing, frame.statistics) for frame in frames]


def whole_surface(take, mesh, index):
    whole = cleaned(mesh).mesh
    return take.surface(whole, depth_artifacts(whole), index)


@pytest.mark.parametrize(("mesh", "kind"), [(ball(), CLOSED), (box((1, 1, 0.01), 3), LAYER), (HALF, OPEN)])
def test_the_kind_of_a_frame(mesh, kind):
    statistics = cleaned(mesh).statistics
    assert surface_kind(statistics.capped, statistics.compactness, statistics.of_pieces) == kind


def test_many_bodies_are_no_layer_and_many_sheets_are_one():
    person, sheet = box((1.7, 0.4, 0.25), 2), box((1, 1, 0.02), 3)
    for mesh, kind in ((person, CLOSED), (sheet, LAYER)):
        crowd = joined(*(moved(mesh, shift=(0, 0, 2.0 * number)) for number in range(20)))
        statistics = cleaned(crowd).statistics
        assert statistics.compactness < 0.02
        assert surface_kind(statistics.capped, statistics.compactness, statistics.of_pieces) == kind


@pytest.mark.parametrize(
    ("kinds", "requested", "expected"),
    [
        ([CLOSED, OPEN, OPEN], "auto", OPEN),
        ([CLOSED, OPEN], "auto", CLOSED),
        ([LAYER, OPEN, LAYER], "auto", LAYER),
        ([OPEN, OPEN], "closed", CLOSED),
        ([CLOSED, CLOSED], "open", OPEN),
        ([LAYER, LAYER], "open", LAYER),
    ],
)
def test_a_take_is_what_most_of_its_frames_are_unless_told(kinds, requested, expected):
    assert take_kind(kinds, requested) == expected


def test_frames_that_face_against_the_others_are_turned():
    take = open_take(OPEN, facts(HALF, inside_out(HALF), moved(HALF, shift=(0.1, 0, 0))))
    assert take.turned == (False, True, False)
    surfaces = [whole_surface(take, mesh, index) for index, mesh in enumerate((HALF, inside_out(HALF)))]
    assert all(area_vectors(surface).sum(axis=0)[2] > 0 for surface in surfaces)


@pytest.mark.parametrize("kind", [LAYER, OPEN])
def test_every_frame_gets_a_closed_body(kind):
    meshes = (HALF, box((1, 1, 0.01), 3), ball())
    take = open_take(kind, facts(*meshes))
    for index, mesh in enumerate(meshes):
        body = take.body(whole_surface(take, mesh, index), index)
        assert is_watertight(body) and signed_volume(body) > 0


def test_the_thickness_is_that_of_the_take_and_scales_with_it():
    small, large = (open_take(OPEN, facts(*[moved(HALF, scale=scale)] * 3)).thickness for scale in (1.0, 10.0))
    assert large == pytest.approx(10 * small)
    one = open_take(OPEN, facts(HALF, HALF, moved(HALF, scale=2.0)))
    assert one.thickness == pytest.approx(small), "one frame in which more is seen has no say"
    assert one.facts_of(0) == one.facts_of(1)
    assert np.isfinite(one.thickness)
