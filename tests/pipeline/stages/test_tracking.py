"""The tracking stage on disk: checkpoints, gaps, and frames that cannot be tracked."""

import shutil

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.tracking.volume import sample_volume
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.pc2 import read_pc2

from ..conftest import FRAMES, TINY
from ..running import cache_entries, finish, remade, report, results

PLANE = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nf 1 2 3 4\n"


@pytest.fixture(scope="module")
def tracked(two_balls, tmp_path_factory):
    output = tmp_path_factory.mktemp("tracked")
    finish(two_balls, output, until="tracking")
    return output


@pytest.fixture
def source(two_balls, tmp_path):
    """A copy of the input, free to be changed."""
    return shutil.copytree(two_balls, tmp_path / "in")


def test_centers_are_written_for_each_frame_and_lie_inside(tracked, two_balls):
    with np.load(tracked / "centers.npz") as centers:
        assert centers["frames"].tolist() == list(FRAMES)
        assert centers["positions"].shape == (len(FRAMES), TINY.tracking.centers, 3)
        for step, positions in enumerate(centers["positions"]):
            middle = np.sign(positions[:, :1]) * [1.5 - 0.1 * step, 0, 0]
            assert (np.linalg.norm(positions - middle, axis=1) < 1).all()


def test_playback_holds_the_positions(tracked):
    with np.load(tracked / "centers.npz") as centers:
        played = np.stack(list(read_pc2(tracked / report(tracked)["centers_playback"])))
        assert_array_equal(played, centers["positions"].astype(np.float32))


def test_figures_are_reported_for_each_frame(tracked, two_balls):
    figures = report(tracked)["tracking"]
    for name in ("dfu", "lloyd_energy", "arap_energy"):
        assert len(figures[name]) == len(FRAMES)
        assert all(value >= 0 for value in figures[name])
    volume = sample_volume(read_mesh(two_balls / "balls_003.obj"), TINY.tracking.resolution, TINY.tracking.centers)
    assert figures["center_spacing"] == pytest.approx(volume.center_spacing(TINY.tracking.centers), rel=1e-6)


def test_a_changed_frame_is_tracked_again_with_those_after_it_and_none_before(source, tmp_path):
    finish(source, tmp_path / "out", until="tracking")
    before = cache_entries(tmp_path / "out")
    ball = trimesh.creation.icosphere(2)
    trimesh.util.concatenate([ball.copy().apply_translation([side, 0, 0]) for side in (-1.35, 1.35)]).export(source / "balls_005.obj")
    finish(source, tmp_path / "out", until="tracking")
    after = cache_entries(tmp_path / "out")
    assert {"tracking/frame_0005", "frames/frame_0005"} <= remade(before, after)
    fresh = tmp_path / "fresh"
    finish(source, fresh, until="tracking")
    assert results(tmp_path / "out") == results(fresh)


def test_frames_added_at_the_end_cost_only_themselves(source, two_balls, tmp_path):
    (source / "balls_005.obj").unlink()
    finish(source, tmp_path / "out", until="tracking")
    before = cache_entries(tmp_path / "out")
    shutil.copy(two_balls / "balls_005.obj", source)
    finish(source, tmp_path / "out", until="tracking")
    made = {"frames/frame_0005", "tracking/frame_0005", "tracking/state", "tracking/bodies", "tracking/figures"}
    assert remade(before, cache_entries(tmp_path / "out")) == made


def test_a_damaged_checkpoint_is_made_again(source, tracked, tmp_path):
    finish(source, tmp_path / "out", until="tracking")
    for name in ("tracking/frame_0004", "tracking/state"):
        path = next((tmp_path / "out" / "cache").glob(name + "-*.npz"))
        path.write_bytes(path.read_bytes()[:200])
        finish(source, tmp_path / "out", until="tracking")
        assert np.array_equal(np.load(tmp_path / "out" / "centers.npz")["positions"], np.load(tracked / "centers.npz")["positions"])


def test_a_gap_is_told_and_holds_the_frame_before(source, tmp_path):
    (source / "balls_004.obj").unlink()
    (source / "balls_005.obj").rename(source / "balls_006.obj")
    shutil.copy(source / "balls_006.obj", source / "balls_007.obj")
    warnings = finish(source, tmp_path / "out", until="tracking")
    found = report(tmp_path / "out")
    assert found["sequence"]["gaps"] == [4, 5]
    assert found["sequence"]["numbers"] == [3, 6, 7]
    assert warnings == found["warnings"] and len(warnings) == 1
    assert warnings[0].startswith("balls lacks frames 4-5; the frame before is held")
    played = list(read_pc2(tmp_path / "out" / found["centers_playback"]))
    positions = np.load(tmp_path / "out" / "centers.npz")["positions"]
    assert_array_equal(played, positions[[0, 0, 0, 1, 2]].astype(np.float32))


@pytest.mark.parametrize("content", [PLANE, "v 0 0 0\nv 2 0 0\nv 1 1 2\nf 1 2 3\n"], ids=["plane", "triangle"])
def test_a_frame_without_volume_is_refused_by_name_and_the_frames_before_it_are_kept(source, tmp_path, content):
    (source / "balls_005.obj").write_text(content)
    with pytest.raises(RefMeshError, match="too little volume") as caught:
        finish(source, tmp_path / "out", until="tracking")
    assert str(source / "balls_005.obj") in str(caught.value)
    assert {"tracking/frame_0003", "tracking/frame_0004"} <= set(cache_entries(tmp_path / "out"))
    assert not (tmp_path / "out" / "centers.npz").exists()


def test_more_centers_than_voxels_is_refused_with_figures(source, tmp_path):
    with pytest.raises(RefMeshError, match=r"voxels lie inside at resolution 16, too few for 2000 centers") as caught:
        finish(source, tmp_path / "out", until="tracking", centers=2000, resolution=16)
    assert "balls_003.obj" in str(caught.value)


@pytest.mark.parametrize("scale", [1e-3, 10.0])
def test_a_scaled_take_has_the_same_figures(source, tracked, tmp_path, scale):
    for path in source.iterdir():
        mesh = trimesh.load(path, process=False)
        mesh.apply_scale(scale).export(path, digits=12)
    finish(source, tmp_path / "out", until="tracking")
    found, plain = (report(folder)["tracking"] for folder in (tmp_path / "out", tracked))
    assert_allclose(found["center_spacing"], scale * plain["center_spacing"], rtol=1e-3)
    for name in ("dfu", "lloyd_energy"):
        assert_allclose(found[name], plain[name], rtol=0.3)


def test_both_affinities_track_and_differ(source, tracked, tmp_path):
    finish(source, tmp_path / "out", until="tracking", affinity="iir")
    positions = [np.load(folder / "centers.npz")["positions"] for folder in (tmp_path / "out", tracked)]
    assert_array_equal(positions[0][:2], positions[1][:2])  # history begins to count with the third frame
    assert not np.array_equal(positions[0][2], positions[1][2])


def test_a_body_that_vanishes_is_named_also_by_a_run_that_only_resumes(source, tmp_path):
    trimesh.creation.icosphere(subdivisions=2).apply_translation([-1.4, 0, 0]).export(source / "balls_005.obj")
    for _ in range(2):
        warnings = finish(source, tmp_path / "out", until="tracking")
        assert any("frame 5: a body is missing: its 25 centers" in warning for warning in warnings)
        assert report(tmp_path / "out")["warnings"] == warnings
