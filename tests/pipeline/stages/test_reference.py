"""What the reference stage writes, checked against the meshes it wrote."""

import numpy as np
from numpy.testing import assert_allclose

from refmesh_addon.core.geometry.mesh import is_watertight, signed_volume, vertex_components
from refmesh_addon.core.reference.reference_centers import reference_centers
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.meshes import read_mesh

from ..conftest import FRAMES, TINY
from ..running import report


def test_the_reference_is_what_the_report_says(finished, two_balls):
    (group,) = report(finished)["groups"]
    mesh = read_mesh(finished / group["reference"])
    assert group["frames"] == list(FRAMES)
    assert group["anchor"] in FRAMES
    assert group["triangles"] == len(mesh.triangles)
    assert group["components"] == vertex_components(mesh)[0] == 2
    assert group["watertight"] is is_watertight(mesh) is True
    assert group["self_intersections"] == 0
    assert abs(len(mesh.triangles) - TINY.reference.triangles) <= 2


def test_each_body_of_the_reference_has_the_volume_and_the_extent_that_it_has_in_the_anchor_frame(finished, two_balls):
    (group,) = report(finished)["groups"]
    found, expected = bodies(read_mesh(finished / group["reference"])), bodies(read_mesh(two_balls / f"balls_{group['anchor']:03d}.obj"))
    assert len(found) == len(expected) == 2
    for mesh, anchor in zip(found, expected):
        assert_allclose(signed_volume(mesh), signed_volume(anchor), rtol=0.1)
        assert_allclose(np.ptp(mesh.vertices, axis=0), np.ptp(anchor.vertices, axis=0), atol=0.2)


def bodies(mesh):
    """Its components, the smallest first."""
    count, component = vertex_components(mesh)
    parts = (mesh.triangles[component[mesh.triangles[:, 0]] == index] for index in range(count))
    compact = (TriangleMesh(mesh.vertices[np.unique(part)], np.unique(part, return_inverse=True)[1].reshape(-1, 3)) for part in parts)
    return sorted(compact, key=lambda body: abs(signed_volume(body)))


def test_reference_centers_are_those_of_the_tracked_positions_set_apart_body_by_body(finished):
    (group,) = report(finished)["groups"]
    with np.load(finished / "centers.npz") as centers:
        positions, found = centers["positions"], centers["group_000_reference_centers"]
    expected = reference_centers(positions)
    moves = found - expected.positions
    steps, body = np.unique(moves.round(9), axis=0, return_inverse=True)
    assert len(steps) == 2, "each ball moves as a whole"
    assert_allclose(np.bincount(body.ravel()) @ steps, 0, atol=1e-6)
    assert group["anchor"] == FRAMES[expected.anchor]
    assert_allclose(group["stress"], expected.stress)


def test_alignment_never_lowers_the_overlap_and_the_group_shows_its_worst_frame(finished):
    (group,) = report(finished)["groups"]
    before, after = group["frame_iou_before"], group["frame_iou_after"]
    assert len(before) == len(after) == len(FRAMES)
    assert all(0 < low <= high <= 1 for low, high in zip(before, after))
    assert (group["iou_before"], group["iou_after"]) == (min(before), min(after))
    anchor = FRAMES.index(group["anchor"])
    assert before[anchor] == after[anchor] == 1.0
