"""Tracking group by group: groups that need nothing of each other, and numbers of centers that go on."""

import numpy as np
import pytest
import trimesh

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.io.meshes import read_mesh

from ..conftest import FRAMES, TINY
from ..running import cache_entries, finish, remade, report, results

CENTERS = TINY.tracking.centers


def balls(*middles):
    return trimesh.util.concatenate([trimesh.creation.icosphere(2).apply_translation([x, 0, 0]) for x in middles])


@pytest.fixture
def source(tmp_path):
    """Six frames in which two balls come nearer."""
    folder = tmp_path / "in"
    folder.mkdir()
    for number in range(1, 7):
        balls(-2 + 0.1 * number, 2 - 0.1 * number).export(folder / f"balls_{number:03d}.obj")
    return folder


def track(source, output, **settings):
    return finish(source, output, until="tracking", tracking="group", group_size=2, **settings)


def positions(output):
    with np.load(output / "centers.npz") as centers:
        return centers["positions"]


def test_each_group_starts_anew_and_numbers_go_on(source, tmp_path):
    track(source, tmp_path / "out")
    found = positions(tmp_path / "out")
    spacing = report(tmp_path / "out")["tracking"]["center_spacing"]
    assert found.shape == (6, CENTERS, 3)
    assert (np.sign(found[:, :, 0]) == np.sign(found[0, :, 0])).all(), "a center keeps its ball"
    steps = np.linalg.norm(np.diff(found, axis=0), axis=2) / spacing
    assert np.median(steps) < 1.0
    assert len(report(tmp_path / "out")["tracking"]["handover"]) == 2


def test_a_group_alone_gives_the_same_centers(source, tmp_path):
    track(source, tmp_path / "out")
    finish(source, tmp_path / "alone", until="tracking", frames="1-2")
    np.testing.assert_array_equal(positions(tmp_path / "out")[:2], positions(tmp_path / "alone"))


def test_a_changed_frame_remakes_only_the_groups_that_see_it(source, tmp_path):
    track(source, tmp_path / "out")
    before = cache_entries(tmp_path / "out")
    balls(-1.75, 1.75).export(source / "balls_003.obj")
    track(source, tmp_path / "out")
    assert remade(before, cache_entries(tmp_path / "out")) == {
        "frames/frame_0003",
        "tracking/group_000",
        "tracking/group_001",
        "tracking/figures",
    }
    track(source, tmp_path / "fresh")
    assert results(tmp_path / "out") == results(tmp_path / "fresh")


def test_a_body_that_comes_late_gets_its_share(source, tmp_path):
    for number in (1, 2):
        balls(-2 + 0.1 * number).export(source / f"balls_{number:03d}.obj")
    warnings = track(source, tmp_path / "out")
    assert any("frame 3" in warning and "appeared" in warning for warning in warnings)
    in_late = (positions(tmp_path / "out")[2] > 0)[:, 0].mean()
    assert in_late == pytest.approx(0.5, abs=0.05)
    finish(source, tmp_path / "sequence", until="tracking")
    assert (positions(tmp_path / "sequence")[2] > 0)[:, 0].mean() == pytest.approx(0.5, abs=0.05), "as tracking the whole sequence gives it"


def test_a_frame_without_volume_is_named(source, tmp_path):
    (source / "balls_006.obj").write_text("v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nf 1 2 3 4\n")  # between others it would be bridged
    with pytest.raises(RefMeshError, match="balls_006.obj: too little volume"):
        track(source, tmp_path / "out")


def test_global_rounds_are_refused_in_words(source, tmp_path):
    with pytest.raises(RefMeshError, match="--tracking sequence"):
        track(source, tmp_path / "out", global_rounds=1)


def test_the_whole_job_runs_on_groups(two_balls, tmp_path):
    finish(two_balls, tmp_path / "out", tracking="group", group_size=2)
    for number, mesh in zip(FRAMES, sorted((tmp_path / "out" / "deformed").glob("*.ply")), strict=True):
        source = read_mesh(two_balls / f"balls_{number:03d}.obj")
        assert np.abs(np.ptp(read_mesh(mesh).vertices, axis=0) / np.ptp(source.vertices, axis=0) - 1).max() < 0.05


def test_a_gap_that_opens_in_a_group_is_tracked_as_in_a_sequence(tmp_path):
    """A block whose lid swings open, at the resolution at which centers would stay in the gap."""
    source = tmp_path / "lid"
    source.mkdir()
    for number, angle in enumerate((0.0, 0.0, 0.2, 0.4)):
        lid = trimesh.creation.box((2.0, 0.5, 0.6)).apply_translation((1.0, 0.24, 0.0))
        lid.apply_transform(trimesh.transformations.rotation_matrix(angle, (0, 0, 1)))
        block = trimesh.creation.box((2.0, 1.0, 0.6)).apply_translation((1.0, -0.5, 0.0))
        trimesh.util.concatenate([block, lid]).export(source / f"lid_{number:03d}.obj")
    fine = {"until": "tracking", "centers": 150, "resolution": 64}
    finish(source, tmp_path / "sequence", **fine)
    finish(source, tmp_path / "group", tracking="group", group_size=4, **fine)
    np.testing.assert_array_equal(positions(tmp_path / "group"), positions(tmp_path / "sequence"))
    assert max(report(tmp_path / "group")["tracking"]["dfu"]) < 0.3
