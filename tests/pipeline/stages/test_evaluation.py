"""Figures and colors of the evaluation stage, measured again from the files."""

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.evaluation.error_scale import error_colors
from refmesh_addon.core.evaluation.metrics import surface_distance
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.io.meshes import read_mesh

from ..conftest import TINY
from ..running import report


@pytest.fixture(scope="module")
def pairs(finished, two_balls):
    """For each frame its entry in the report, its source and the deformed reference."""
    frames = report(finished)["frames"]
    return [(frame, read_mesh(two_balls / f"balls_{frame['number']:03d}.obj"), read_mesh(finished / frame["deformed"])) for frame in frames]


def test_figures_are_those_of_the_files_whichever_points_are_sampled(pairs):
    for frame, source, deformed in pairs:
        found = surface_distance(source, deformed, TINY.evaluation.samples, np.random.default_rng(7))
        for side in ("source_to_deformed", "deformed_to_source"):
            assert_allclose(frame[side]["mean"], getattr(found, side).mean, rtol=0.15)
            assert_allclose(frame[side]["rms"], getattr(found, side).rms, rtol=0.2)
            assert frame[side]["mean"] <= frame[side]["rms"] <= frame[side]["max"]
            assert frame[side]["p99"] <= frame[side]["max"]
        assert frame["d2_psnr"] == pytest.approx(found.d2_psnr, abs=2)
        assert frame["d1_psnr"] <= frame["d2_psnr"]


def test_vertices_are_colored_by_their_distance(finished, pairs):
    for frame, source, deformed in pairs:
        distances = SurfaceIndex(source).query(deformed.vertices).distances / source.diagonal
        shown = trimesh.load(finished / frame["deformed"], process=False).visual.vertex_colors
        assert_array_equal(shown, error_colors(distances))


def test_velocities_are_how_far_vertices_go_in_a_frame(finished, pairs):
    """Between neighbors half of the way from the one to the other; nothing is lost on the way to the file but single precision."""
    for group in report(finished)["groups"]:
        frames = [(frame["number"], finished / frame["deformed"]) for frame, _, _ in pairs if frame["group"] == group["index"]]
        positions = {number: read_mesh(path).vertices for number, path in frames}
        for number, path in frames:
            rows = trimesh.load(path, process=False).metadata["_ply_raw"]["vertex"]["data"]
            found = np.column_stack([rows[name] for name in ("vx", "vy", "vz")])
            if number - 1 in positions and number + 1 in positions:
                assert_allclose(found, (positions[number + 1] - positions[number - 1]) / 2, rtol=1e-5, atol=1e-6)
            assert np.isfinite(found).all()
