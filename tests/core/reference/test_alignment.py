"""Alignment with the anchor frame: what it recovers, and that the overlap never falls."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import sparse

from refmesh_addon.core.geometry.voxels import fill, grid_around
from refmesh_addon.core.reference.alignment import align
from refmesh_addon.core.reference.anchor_frame import AnchorFrame
from refmesh_addon.core.reference.mapping import FrameMap
from refmesh_addon.core.tracking import lloyd
from refmesh_addon.core.tracking.affinity import near_pairs
from refmesh_addon.core.tracking.volume import sample_volume
from refmesh_addon.core.types import TriangleMesh

from ..shapes import TILT, box, joined, moved

CENTERS = 60
UNLINKED = sparse.identity(CENTERS, format="csr")
BODY = moved(joined(box(subdivisions=4), box((0.5, 0.5, 0.9), subdivisions=4, center=(0.9, 0.2, 0.7))), TILT)


class Scene:
    """A body bound to its centers, and itself as the anchor frame."""

    def __init__(self, mesh=BODY):
        volume = sample_volume(mesh, 32, CENTERS)
        self.spacing = volume.center_spacing(CENTERS)
        self.centers = lloyd.spread(volume, CENTERS)
        affinity = near_pairs(self.centers, self.spacing).weights()
        self.frame = FrameMap(mesh, self.centers, affinity, self.spacing)
        self.anchor = AnchorFrame.of(mesh, np.ones(len(mesh.triangles), dtype=bool), affinity)


@pytest.fixture(scope="module")
def scene():
    return Scene()


def swayed(centers, length):
    """Centers off by a smooth field of about this length."""
    return centers + length * np.sin(2.0 * centers[:, [1, 2, 0]] + [0.0, 1.0, 2.0])


@pytest.mark.parametrize("share", [0.1, 0.2, 0.4])
def test_a_small_deformation_is_undone(scene, share):
    start = swayed(scene.centers, share * scene.spacing)
    alignment = align(scene.frame, start, scene.anchor, 10)
    assert alignment.after > 0.97
    assert (1 - alignment.after) < 0.4 * (1 - alignment.before)
    missed = lambda targets: np.linalg.norm(scene.frame.to(targets).vertices - BODY.vertices, axis=1).mean()
    assert missed(alignment.targets) < 0.7 * missed(start)


@pytest.mark.parametrize("seed", range(5))
def test_the_overlap_never_falls_whatever_the_start(scene, seed):
    rng = np.random.default_rng(seed)
    start = scene.centers + rng.choice([0.1, 0.5, 2.0]) * scene.spacing * rng.normal(size=scene.centers.shape)
    history = [align(scene.frame, start, scene.anchor, steps) for steps in range(4)]
    assert {alignment.before for alignment in history} == {history[0].after}
    for alignment in history:
        assert alignment.before <= alignment.after
        assert alignment.after == scene.anchor.iou(scene.frame.closed(alignment.mesh)), "the figure is that of the mesh given back"
        moved_by_centers = scene.anchor.iou(scene.frame.closed(scene.frame.to(alignment.targets)))
        assert alignment.before <= moved_by_centers <= alignment.after


def test_what_fits_already_is_left_alone(scene):
    alignment = align(scene.frame, scene.centers, scene.anchor, 5)
    assert (alignment.before, alignment.after) == (1.0, 1.0)
    assert_array_equal(alignment.targets, scene.centers)


def test_no_steps_change_nothing(scene):
    start = swayed(scene.centers, 0.3 * scene.spacing)
    alignment = align(scene.frame, start, scene.anchor, 0)
    assert_array_equal(alignment.targets, start)
    assert alignment.before == alignment.after < 1


def test_a_frame_without_a_partner_in_reach_is_given_back(scene):
    start = scene.centers + 100 * scene.spacing
    alignment = align(scene.frame, start, scene.anchor, 3)
    assert_array_equal(alignment.targets, start)
    assert (alignment.before, alignment.after) == (0.0, 0.0)


@pytest.mark.parametrize("change", [{"scale": 10.0}, {"scale": 1e-3}, {"shift": (20.0, -30.0, 5.0)}])
def test_scaling_and_moving_the_input_does_the_same_to_the_result(scene, change):
    start = swayed(scene.centers, 0.3 * scene.spacing)
    plain = align(scene.frame, start, scene.anchor, 3)
    scale, shift = change.get("scale", 1.0), np.array(change.get("shift", (0.0, 0.0, 0.0)))
    mesh = moved(BODY, **change)
    frame = FrameMap(mesh, scale * scene.centers + shift, scene.frame.affinity, scale * scene.spacing)
    alignment = align(frame, scale * start + shift, AnchorFrame.of(mesh, np.ones(len(mesh.triangles), dtype=bool), scene.frame.affinity), 3)
    assert_allclose(alignment.targets, scale * plain.targets + shift, atol=0.01 * scale * scene.spacing)
    assert (alignment.before, alignment.after) == (pytest.approx(plain.before, abs=1e-3), pytest.approx(plain.after, abs=1e-3))


def test_the_overlap_is_that_of_the_two_volumes(scene):
    smaller = moved(BODY, scale=0.9)
    grid = grid_around(BODY.vertices, 128)
    one, other = fill(smaller, grid), fill(BODY, grid)
    assert scene.anchor.iou(smaller) == np.count_nonzero(one & other) / np.count_nonzero(one | other)
    assert scene.anchor.iou(smaller) == pytest.approx(0.9**3, abs=0.05)


def test_torn_triangles_of_the_anchor_attract_nothing():
    body = box((1.0, 1.0, 1.0), subdivisions=3)
    sheet = TriangleMesh(np.array([[-0.5, -0.5, 0.6], [0.5, -0.5, 0.6], [0.5, 0.5, 0.6]]), [[0, 1, 2]])
    both = joined(body, sheet)
    anchor = AnchorFrame.of(both, np.arange(len(both.triangles)) < len(body.triangles), UNLINKED)
    assert_allclose(np.abs(anchor.tree.data).max(axis=0), 0.5, atol=1e-9)
    assert_allclose(np.abs(anchor.normals).max(axis=1), 1.0)


def test_what_leaves_the_anchors_box_counts_against_the_overlap():
    body = box((1.0, 1.0, 1.0))
    anchor = AnchorFrame.of(body, np.ones(len(body.triangles), dtype=bool), UNLINKED)
    assert anchor.iou(joined(body, box((1.0, 1.0, 1.0), center=(2.0, 0, 0)))) == pytest.approx(0.5, abs=0.02)
    assert anchor.iou(moved(body, shift=(0.5, 0, 0))) == pytest.approx(1 / 3, abs=0.02)
