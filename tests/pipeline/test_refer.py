"""What the reference stage writes, checked against the meshes it wrote."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.geometry import is_watertight, signed_volume, vertex_components
from refmesh_addon.core.reference_centers import largest_distances, reference_centers, stress
from refmesh_addon.io.meshes import read_mesh

from .conftest import FRAMES
from .running import report


def test_the_reference_is_what_the_report_says(finished, two_balls):
    (group,) = report(finished)["groups"]
    mesh = read_mesh(finished / group["reference"])
    assert group["frames"] == list(FRAMES)
    assert group["anchor"] in FRAMES
    assert group["triangles"] == len(mesh.triangles)
    assert group["components"] == vertex_components(mesh)[0] == 2
    assert group["watertight"] is is_watertight(mesh) is True
    assert group["self_intersections"] == 0
    budget = np.median([len(read_mesh(path).triangles) for path in two_balls.iterdir()])
    assert abs(len(mesh.triangles) - budget) <= 2


def test_the_reference_has_the_volume_of_the_frames_and_stands_where_the_anchor_does(finished, two_balls):
    (group,) = report(finished)["groups"]
    mesh = read_mesh(finished / group["reference"])
    anchor = read_mesh(two_balls / f"balls_{group['anchor']:03d}.obj")
    assert_allclose(signed_volume(mesh), signed_volume(anchor), rtol=0.1)
    assert_allclose(mesh.vertices.min(axis=0), anchor.vertices.min(axis=0), atol=0.1)
    assert_allclose(mesh.vertices.max(axis=0), anchor.vertices.max(axis=0), atol=0.1)


def test_reference_centers_are_those_of_the_tracked_positions(finished):
    (group,) = report(finished)["groups"]
    with np.load(finished / "centers.npz") as centers:
        positions, found = centers["positions"], centers["group_000_reference_centers"]
        assert_array_equal(centers["group_000_center_indices"], np.arange(positions.shape[1]))
    expected = reference_centers(positions)
    assert_allclose(found, expected.positions, atol=1e-9)
    assert group["anchor"] == FRAMES[expected.anchor]
    assert_allclose(group["stress"], stress(found, largest_distances(positions)))


def test_alignment_never_lowers_the_overlap_and_the_group_shows_its_worst_frame(finished):
    (group,) = report(finished)["groups"]
    before, after = group["frame_iou_before"], group["frame_iou_after"]
    assert len(before) == len(after) == len(FRAMES)
    assert all(0 < low <= high <= 1 for low, high in zip(before, after))
    assert (group["iou_before"], group["iou_after"]) == (min(before), min(after))
    anchor = FRAMES.index(group["anchor"])
    assert before[anchor] == after[anchor] == 1.0
