"""The reference mesh in one frame, with and without what the paper leaves out."""

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.arrays import to_arrays
from refmesh_addon.core.deformation import deformer
from refmesh_addon.core.deformation.deformer import GroupReference, ReferenceDeformer, deform_reference
from refmesh_addon.core.deformation.facing import Facing
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.geometry.mesh import submesh
from refmesh_addon.core.reference.group import GroupCenters
from refmesh_addon.core.reference.mapping import FrameMap
from refmesh_addon.core.settings import DeformationSettings
from refmesh_addon.core.tracking import lloyd
from refmesh_addon.core.tracking.affinity import near_pairs
from refmesh_addon.core.tracking.volume import sample_volume
from refmesh_addon.core.types import TriangleMesh

CENTERS = 60
SETTINGS = DeformationSettings(fit_rounds=4)


def bent(points):
    """A bar along x, bent about y."""
    angle = 0.25 * points[:, 0]
    return np.stack([np.sin(angle) * (4 + points[:, 2]), points[:, 1], np.cos(angle) * (4 + points[:, 2]) - 4], axis=1)


def bar(subdivisions):
    """Its vertices a little off the faces, so that no two places on it look the same."""
    box = trimesh.creation.box([3.0, 0.8, 0.6])
    for _ in range(subdivisions):
        box = box.subdivide()
    noise = 0.003 * np.random.default_rng(subdivisions).normal(size=box.vertices.shape)
    return TriangleMesh(box.vertices + noise, np.asarray(box.faces))


@pytest.fixture(scope="module")
def scene():
    """The bar as reference, its centers, and the bent bar with other triangles as the frame."""
    reference, other = bar(4), bar(3)
    volume = sample_volume(reference, 32, CENTERS)
    centers = lloyd.spread(volume, CENTERS)
    spacing = volume.center_spacing(CENTERS)
    group = GroupCenters(centers, near_pairs(centers, spacing).weights(), spacing, 0, 0.0)
    return reference, centers, other.moved(bent(other.vertices)), bent(centers), group


def deformed(scene, settings):
    reference, targets, mesh, centers, group = scene
    return ReferenceDeformer(GroupReference("", reference, group, settings)).to(targets, mesh, centers)


def test_the_fit_lies_on_the_source(scene):
    mesh = scene[2]
    frame = deformed(scene, SETTINGS)
    assert frame.vertices.shape == scene[0].vertices.shape
    assert SurfaceIndex(mesh).query(frame.vertices).distances.mean() < 0.002 * mesh.diagonal
    assert np.mean(frame.held) < 0.2
    assert not Facing(scene[0], frame.rotations).folded(frame.vertices).any()
    assert not frame.hidden.any()


def test_surface_out_of_view_gives_way_farther_to_turn_folds_back(scene, monkeypatch):
    """Two rings around what has no source as well; of bodies that are seen all round, nothing but contacts does."""
    reference, targets, mesh, centers, group = scene
    seen = submesh(mesh, mesh.vertices[mesh.triangles][:, :, 0].max(axis=1) < 0.3)[0]
    free, plain = [], deformer.unfolded
    monkeypatch.setattr(deformer, "unfolded", lambda *arguments: free.append(arguments[-1]) or plain(*arguments))
    for is_view in (False, True):
        whole = GroupReference("", reference, group, SETTINGS, is_open=True, is_view=is_view)
        frame = ReferenceDeformer(whole).to(targets, seen, centers)
    assert not free[0].any() and not (Facing(reference, frame.rotations).folded(frame.vertices) & ~frame.curled).any()
    assert free[1][frame.held].all() and frame.held.sum() < free[1].sum() < len(free[1])
    assert reference.vertices[~free[1], 0].max() < reference.vertices[free[1], 0].mean()


def test_no_rounds_stop_after_the_key_points(scene):
    frame = deformed(scene, DeformationSettings(fit_rounds=0))
    assert frame.held.all()
    mesh = scene[2]
    distances = [SurfaceIndex(mesh).query(result.vertices).distances.mean() for result in (frame, deformed(scene, SETTINGS))]
    assert distances[1] < distances[0]


def test_key_points_are_vertices_that_go_to_vertices_of_the_frame(scene):
    frame, (reference, _, mesh, _, _) = deformed(scene, SETTINGS), scene
    assert len(frame.keypoints) == len(frame.keypoint_targets)
    assert (frame.keypoints < len(reference.vertices)).all()
    for target in frame.keypoint_targets:
        assert (mesh.vertices == target).all(axis=1).any()


def test_the_same_input_gives_the_same_bytes(scene):
    first, again = deformed(scene, SETTINGS), deformed(scene, SETTINGS)
    for name, values in to_arrays(first).items():
        assert_array_equal(values, getattr(again, name))


def test_what_was_asked_before_does_not_matter(scene):
    """One process builds a reference once and is asked for any of its frames, or for those of other groups, in any order."""
    reference, targets, mesh, centers, group = scene
    references = [GroupReference(key, reference, group, DeformationSettings(fit_rounds=rounds)) for key, rounds in (("a", 2), ("b", 0))]
    frames = [(targets, mesh, centers), (targets, reference, targets)]
    expected = [ReferenceDeformer(references[0]).to(*frame) for frame in frames]
    deform_reference(references[1], *frames[0])
    for index in (1, 0, 1):
        frame = deform_reference(references[0], *frames[index])
        for name, values in to_arrays(expected[index]).items():
            assert_array_equal(getattr(frame, name), values)


def test_the_mesh_goes_back_in_the_way_that_the_frames_came(scene):
    """What the spline has mapped to the reference positions, the spline carries back better than blended motions do."""
    frame, centers, _, _, group = scene
    targets = bent(centers) * [1.0, 1.2, 0.8]
    mapped = FrameMap(frame, centers, group.affinity, group.spacing, "rbf").to(targets)
    errors = []
    for mapping in ("rbf", "affinity"):
        reference = GroupReference("", mapped, group, DeformationSettings(fit_rounds=0), mapping)
        back = ReferenceDeformer(reference).to(targets, frame, centers)
        errors.append(np.linalg.norm(back.vertices - frame.vertices, axis=1).mean())
    assert errors[0] < 0.5 * errors[1]


@pytest.mark.parametrize("scale", [2.0**-10, 10.0])
def test_scaling_everything_scales_the_result(scene, scale):
    reference, targets, mesh, centers, group = scene
    larger = GroupCenters(scale * group.positions, group.affinity, scale * group.spacing, 0, 0.0)
    scaled = (reference.moved(scale * reference.vertices), scale * targets, mesh.moved(scale * mesh.vertices), scale * centers, larger)
    assert_allclose(deformed(scaled, SETTINGS).vertices, scale * deformed(scene, SETTINGS).vertices, atol=1e-6 * scale)


def test_key_points_never_lead_astray(scene):
    """Tracking knows where each point goes; what the key points add must not take it elsewhere."""
    reference, targets, mesh, centers, group = scene
    start = FrameMap(reference, targets, group.affinity, group.spacing).to(centers).vertices
    posed, fitted = (deformed(scene, DeformationSettings(fit_rounds=rounds)).vertices for rounds in (0, 4))
    source = SurfaceIndex(mesh)
    assert source.query(posed).distances.mean() <= 1.5 * source.query(start).distances.mean()
    errors = [np.linalg.norm(vertices - bent(reference.vertices), axis=1).mean() for vertices in (start, posed, fitted)]
    assert errors[1] <= 1.5 * errors[0]
    assert errors[2] <= 1.2 * errors[0]
