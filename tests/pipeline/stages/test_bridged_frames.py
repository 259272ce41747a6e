"""Bad frames in a run: no stage follows them, the mesh moves on over them, and the report names them."""

import shutil

import numpy as np
import pytest
import trimesh

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.io.discovery import find_sequence
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.pc2 import read_pc2
from refmesh_addon.io.ply import write_ply
from refmesh_addon.pipeline.session.job import CHECK, JobSpec
from refmesh_addon.pipeline.stages.check import check_sequence
from sample_scenes.generators.shapes import ball, capsule, union
from sample_scenes.generators.surface import iso_surface

from ..running import cache_entries, finish, report, shared_workers

BAD = 5
SEGMENTS = {"segments": "long", "group_size": 3}


def balls(folder, number: int, rng: np.random.Generator, sides=(-1, 1)) -> None:
    turn = lambda: trimesh.transformations.random_rotation_matrix(rng.random(3))
    place = lambda side: [1.5 * side + 0.05 * number, 0.01 * number**2, 0.0]
    parts = [trimesh.creation.icosphere(subdivisions=2).apply_transform(turn()).apply_translation(place(side)) for side in sides]
    trimesh.util.concatenate(parts).export(folder / f"balls_{number:03d}.obj")


@pytest.fixture(scope="module")
def flickering(tmp_path_factory):
    """Folder of seven frames: two balls, of which one is missing in the fifth."""
    folder, rng = tmp_path_factory.mktemp("flickering"), np.random.default_rng(0)
    for number in range(1, 8):
        balls(folder, number, rng, (-1,) if number == BAD else (-1, 1))
    return folder


@pytest.fixture(scope="module")
def bridged(flickering, tmp_path_factory):
    output = tmp_path_factory.mktemp("bridged")
    return output, finish(flickering, output, **SEGMENTS)


def moved(output, start: int, end: int) -> np.ndarray:
    """(2, 3) how far the mesh of each ball moves from one frame to another."""
    before, after = (read_mesh(output / f"deformed/frame_{number:04d}.ply").vertices for number in (start, end))
    right = before[:, 0] > 0.05 * start
    return np.array([(after - before)[right == side].mean(axis=0) for side in (False, True)])


def test_the_mesh_moves_on_over_a_bad_frame(bridged):
    output, warnings = bridged
    (entry,) = report(output)["bad_frames"]
    assert (entry["frame"], entry["before"], entry["after"], entry["bridged"]) == (BAD, BAD - 1, BAD + 1, True)
    assert "of the surface is missing" in entry["reason"] and entry["position"][0] > 1.0
    assert len([line for line in warnings if line.startswith(f"frame {BAD}: ") and "bridged from frames 4 and 6" in line]) == 1
    np.testing.assert_allclose(moved(output, BAD - 1, BAD), [[0.05, 0.01 * (BAD**2 - (BAD - 1) ** 2), 0.0]] * 2, atol=0.02)


def test_the_others_have_one_mesh_and_no_center_follows_the_bad_frame(bridged):
    output, _ = bridged
    (group,) = report(output)["groups"]
    assert group["frames"] == [1, 2, 3, 4, 6, 7]
    frames = {frame["number"]: frame for frame in report(output)["frames"]}
    assert list(frames) == list(range(1, 8))
    assert frames[BAD]["between"] == [4, 6] and frames[BAD]["held"] == 1.0 and "source_to_deformed" not in frames[BAD]
    with np.load(output / "centers.npz") as centers:
        assert centers["frames"].tolist() == group["frames"]


def test_the_playback_has_a_row_for_each_scene_frame(bridged):
    output, _ = bridged
    rows = np.stack(list(read_pc2(output / report(output)["groups"][0]["playback"])))
    assert len(rows) == 7
    for number, vertices in enumerate(rows, 1):
        written = read_mesh(output / f"deformed/frame_{number:04d}.ply").vertices
        np.testing.assert_allclose(vertices, written, atol=1e-5)


def test_a_cut_holds_the_frame_before_and_begins_another_mesh(flickering, bridged, tmp_path):
    output = shutil.copytree(bridged[0], tmp_path / "out")
    before = cache_entries(output)
    finish(flickering, output, bad_frames="cut", **SEGMENTS)
    groups = report(output)["groups"]
    assert [group["frames"] for group in groups] == [[1, 2, 3, 4], [6, 7]]
    assert groups[1]["reason"] == "the frames before are bad and are left out"
    held, last = (read_mesh(output / f"deformed/frame_{number:04d}.ply").vertices for number in (BAD, BAD - 1))
    np.testing.assert_array_equal(held, last)
    assert {name for name in before if name.startswith("tracking/frame")} <= cache_entries(output).keys()
    assert [len(list(read_pc2(output / group["playback"]))) for group in groups] == [5, 2]


def test_bad_frames_can_be_fitted_all_the_same(flickering, tmp_path):
    finish(flickering, tmp_path, bad_frames="fit", until="tracking")
    assert report(tmp_path)["bad_frames"] == []
    with np.load(tmp_path / "centers.npz") as centers:
        assert centers["frames"].tolist() == list(range(1, 8))


def test_a_bad_frame_that_settings_name_gives_way_to_the_next_or_is_refused_with_advice(flickering, tmp_path):
    finish(flickering, tmp_path, until="reference", segments="groups", group_starts=str(BAD))
    assert [group["frames"] for group in report(tmp_path)["groups"]] == [[1, 2, 3, 4], [6, 7]]
    with pytest.raises(RefMeshError, match="is missing in frame 5: take 4 or 6, or --bad-frames fit"):
        finish(flickering, tmp_path, until="reference", apart=f"{BAD}: 0 0 0 | 1 0 0")


def test_the_check_names_a_bad_frame(flickering, tmp_path):
    job = JobSpec(str(flickering), str(tmp_path), until=CHECK)
    findings = check_sequence(job, find_sequence(flickering), lambda *_: None, shared_workers())
    (bad,) = [finding for finding in findings if finding.kind == "bad"]
    assert bad.frame == BAD and bad.severity == "note" and "is missing; the frame is not fitted" in bad.message


def test_missing_frames_are_bridged_as_well(flickering, bridged, tmp_path):
    finish(flickering, tmp_path, until="deformation", frames=f"1-{BAD - 1},{BAD + 1}-7", **SEGMENTS)
    assert report(tmp_path)["bad_frames"] == []
    played, expected = (np.stack(list(read_pc2(output / report(output)["groups"][0]["playback"]))) for output in (tmp_path, bridged[0]))
    np.testing.assert_array_equal(played, expected)


def test_a_first_frame_without_a_limb_holds_the_next_one(tmp_path):
    arm = lambda number: capsule((0.05 * number, 0, 0), (0.05 * number + 1.2, 0, 0), 0.25)
    for number in range(1, 6):
        solid = union(ball((0.05 * number, 0, 0), 0.7), *([arm(number)] if number > 1 else []))
        write_ply(tmp_path / f"in_{number}.ply", iso_surface(solid, np.zeros(3), 2.2, 0.2, np.random.default_rng(number)))
    warnings = finish(tmp_path, tmp_path / "out", until="deformation", bad_frames="cut", centers=60, triangles=500, **SEGMENTS)
    (line,) = [line for line in warnings if line.startswith("frame 1: ")]
    assert "of the surface is missing" in line and "left out, and frame 2 is held" in line
    (entry,) = report(tmp_path / "out")["bad_frames"]
    assert (entry["frame"], entry["before"], entry["after"], entry["bridged"]) == (1, 2, 2, False)
    first, second = (read_mesh(tmp_path / f"out/deformed/frame_{number:04d}.ply").vertices for number in (1, 2))
    np.testing.assert_array_equal(first, second)
    (group,) = report(tmp_path / "out")["groups"]
    assert group["frames"] == [2, 3, 4, 5]
    assert [frame["number"] for frame in report(tmp_path / "out")["frames"]] == [1, 2, 3, 4, 5]
