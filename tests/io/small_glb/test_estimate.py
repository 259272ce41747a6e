from dataclasses import replace

import numpy as np
import pytest

from refmesh_addon.core.color.layout import Layout
from refmesh_addon.io.refmesh_stream.writer import FrameGroup
from refmesh_addon.io.small_glb.choice import SmallGlb
from refmesh_addon.io.small_glb.estimate import estimated
from refmesh_addon.io.small_glb.writer import encoded
from tests.core import shapes
from tests.io.refmesh_stream.bodies import waving
from tests.io.small_glb.test_surface import painted, tinted

DIAGONAL, RATE = 4.0, 30.0
MESH = shapes.ball(4)
GROUP = FrameGroup(tuple(range(12)), waving(MESH, 12), MESH.triangles)


def spherical_layout(mesh):
    """With hardly a seam, as charts of xatlas have few."""
    x, y, z = mesh.vertices.T
    return Layout(np.column_stack([np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))]) / 7.0 + 0.5, mesh.triangles)


@pytest.mark.parametrize(
    ("error", "packed", "color"), [(1e-3, False, None), (1e-4, True, None), (1e-3, True, painted), (1e-4, False, tinted)]
)
def test_the_size_is_right_within_a_third(error, packed, color):
    group = color(GROUP) if color else GROUP
    choice = SmallGlb(error=error, packed=packed, texture=256, unwrap=spherical_layout)
    data, runs = encoded([group], DIAGONAL, RATE, choice)
    estimate = estimated([group], DIAGONAL, RATE, choice)
    assert 0.67 < estimate.size / len(data) < 1.5
    assert estimate.mbps == pytest.approx(8e-6 * estimate.size * RATE / 12, rel=1e-3)
    assert max(run.error for run in runs) <= estimate.error * 1.001


def test_a_still_frame_has_an_estimate_too():
    group = FrameGroup((3,), MESH.vertices[None], MESH.triangles)
    choice = replace(SmallGlb(), packed=True)
    assert 0.67 < estimated([group], DIAGONAL, RATE, choice).size / len(encoded([group], DIAGONAL, RATE, choice)[0]) < 1.5
    assert np.isfinite(estimated([group], DIAGONAL, RATE, choice).mbps)
