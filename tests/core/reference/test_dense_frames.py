"""Dense frames are aligned by coarse copies: to the same place, with the feature lines of the whole frame."""

import numpy as np
import pytest

from refmesh_addon.core.reference import group
from refmesh_addon.core.reference.group import GroupCenters, align_frame, anchor_frame
from refmesh_addon.core.settings import ReferenceSettings
from refmesh_addon.core.surfacing.hole_caps import without_holes
from refmesh_addon.core.tracking import lloyd
from refmesh_addon.core.tracking.affinity import near_pairs
from refmesh_addon.core.tracking.volume import sample_volume

from ..shapes import TILT, box, moved

CENTERS = 60
BODY = moved(box(subdivisions=5), TILT)


def aligned(sway):
    """A frame whose centers are off by a smooth field, aligned with the body as it is."""
    volume = sample_volume(BODY, 32, CENTERS)
    spacing, centers = volume.center_spacing(CENTERS), lloyd.spread(volume, CENTERS)
    shared = GroupCenters(centers, near_pairs(centers, spacing).weights(), spacing, 0, 0.0)
    settings, body = ReferenceSettings(alignment_steps=6), without_holes(BODY)
    anchor = anchor_frame(body, centers, shared, settings)
    tracked = centers + sway * spacing * np.sin(2.0 * centers[:, [1, 2, 0]])
    return align_frame(body, tracked, anchor, shared, settings, 500), spacing


@pytest.mark.parametrize("sway", [0.0, 0.3])
def test_a_coarse_copy_is_aligned_as_the_frame_is(monkeypatch, sway):
    whole, spacing = aligned(sway)
    monkeypatch.setattr(group, "DENSE_TRIANGLES", 5000)
    monkeypatch.setattr(group, "ALIGNED_VERTICES", 1500)
    coarse, _ = aligned(sway)
    assert np.linalg.norm(coarse.targets - whole.targets, axis=1).max() < 0.1 * spacing
    assert coarse.iou_after == pytest.approx(whole.iou_after, abs=0.02)
    assert len(coarse.features.edges) == len(whole.features.edges) > 0
    ends = [one.features.mesh.vertices[one.features.edges].reshape(-1, 3) for one in (coarse, whole)]
    assert np.linalg.norm(ends[0] - ends[1], axis=1).max() < 0.2 * spacing
