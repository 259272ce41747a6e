"""A long run is smoothed in blocks, with the result of smoothing it all at once."""

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from refmesh_addon.core.deformation.deformer import DeformedFrame
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.pipeline.stages.deformation import BLOCK, block_of, blocks, smooth_block, smoothing_rows
from refmesh_addon.pipeline.stages.groups import FrameGroup


def fitted_frames(mesh: TriangleMesh, count: int) -> list[DeformedFrame]:
    """A ball that flies along a curve, with jitter."""
    rng, none = np.random.default_rng(0), np.zeros(0, dtype=int)
    frames = []
    for row in range(count):
        vertices = mesh.vertices + [0.02 * row**2, 0.1 * row, 0.0] + 0.005 * rng.standard_normal(mesh.vertices.shape)
        held, hidden, curled = [rng.random(size) < 0.1 for size in (len(vertices), len(vertices), len(mesh.triangles))]
        turns = Rotation.identity(len(vertices)).as_rotvec()
        present = np.zeros(len(vertices), dtype=bool)
        frames.append(DeformedFrame(vertices, none, np.zeros((0, 3)), held, hidden, present, curled, turns))
    return frames


@pytest.mark.parametrize("steady", [0, 2])
def test_blocks_together_are_the_whole_run(steady):
    shape = trimesh.creation.icosphere(subdivisions=2)
    mesh, count = TriangleMesh(shape.vertices, shape.faces), 2 * BLOCK + 3
    frames, times = fitted_frames(mesh, count), np.arange(count) + 5.0
    whole = smooth_block(mesh, frames, times, steady)
    group = FrameGroup(0, tuple(range(count)), None, "key", tuple(range(count)), segment=True)
    assert len(blocks(group)) == 3
    parts = []
    for block in blocks(group):
        window, needed, own = smoothing_rows(block, count, steady)
        parts.append(smooth_block(mesh, frames[window], times[window], steady, needed, own))
    for name in ("vertices", "velocities", "flipped", "held", "hidden"):
        assert_allclose(np.concatenate([getattr(part, name) for part in parts]), getattr(whole, name), rtol=0, atol=1e-6)
    assert max(len(frames[smoothing_rows(block, count, steady)[0]]) for block in blocks(group)) <= BLOCK + 2 + 4 * steady


@pytest.mark.parametrize("first", [0, 1, BLOCK - 1, BLOCK, 2 * BLOCK + 4])
@pytest.mark.parametrize("segment", [True, False])
def test_every_frame_is_in_the_block_that_reaches_it(first, segment):
    frames = tuple(range(first, first + 2 * BLOCK + 3))
    group = FrameGroup(0, frames, frames[-1] + 1, "key", frames, segment=segment)
    held = {row: (index, start) for index, (start, end) in enumerate(blocks(group)) for row in range(start, end)}
    assert [block_of(group, row) for row in range(len(group.reached))] == [held[row] for row in range(len(group.reached))]
