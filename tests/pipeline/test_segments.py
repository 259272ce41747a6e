"""Runs of frames that share one mesh: how long they are, why they end, and what a second run computes again."""

import numpy as np
import pytest
import trimesh

from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.pc2 import read_pc2

from .conftest import FRAMES
from .running import cache_entries, finish, remade, report, results


def runs(output):
    return [group["frames"] for group in report(output)["groups"]]


@pytest.fixture(scope="module")
def ball_to_ring(tmp_path_factory):
    """A ball for four frames, then for four a ring of the same volume: no mesh of the one serves the other."""
    folder = tmp_path_factory.mktemp("ring")
    for number in range(8):
        thickness = np.sqrt(4 / (6 * np.pi))
        body = trimesh.creation.icosphere(subdivisions=3) if number < 4 else trimesh.creation.torus(1.0, thickness)
        body.apply_translation([0.02 * number, 0, 0]).export(folder / f"body_{number}.obj")
    return folder


def test_a_take_that_only_moves_has_one_mesh_one_cache_and_velocities_throughout(two_balls, tmp_path):
    finish(two_balls, tmp_path, segments="long", group_size=1)
    (group,) = report(tmp_path)["groups"]
    assert group["frames"] == list(FRAMES) and group["reason"] == "the take begins"
    assert len(list(read_pc2(tmp_path / group["playback"]))) == len(FRAMES)
    meshes = [read_mesh(tmp_path / frame["deformed"]) for frame in report(tmp_path)["frames"]]
    assert all(np.array_equal(mesh.triangles, meshes[0].triangles) for mesh in meshes)
    assert len(list((tmp_path / "playback").glob("group_*.pc2"))) == 1


def test_a_given_number_of_frames_or_given_starts_are_kept_to(two_balls, tmp_path):
    finish(two_balls, tmp_path / "n", segments="frames", segment_frames=2, until="reference")
    assert runs(tmp_path / "n") == [[3, 4], [5]]
    finish(two_balls, tmp_path / "starts", segments="long", group_starts="4", until="reference")
    assert runs(tmp_path / "starts") == [[3], [4, 5]]
    assert [group["reason"] for group in report(tmp_path / "starts")["groups"]] == ["the take begins", "as requested"]


def test_another_run_begins_where_the_mesh_no_longer_serves_and_says_why(ball_to_ring, tmp_path):
    finish(ball_to_ring, tmp_path, segments="long", group_size=2)
    assert 4 in [frames[0] for frames in runs(tmp_path)]
    assert len(runs(tmp_path)) < 4, "fewer meshes than groups"
    reason = next(group["reason"] for group in report(tmp_path)["groups"] if group["frames"][0] == 4)
    assert reason.startswith("one mesh does not serve both sides: frame") and "%" in reason
    assert [frame["number"] for frame in report(tmp_path)["frames"]] == list(range(8))


def test_a_second_run_computes_nothing_and_gives_the_same(ball_to_ring, tmp_path):
    output = tmp_path / "out"
    finish(ball_to_ring, output, segments="long", group_size=2)
    before, first = cache_entries(output), results(output)
    finish(ball_to_ring, output, segments="long", group_size=2)
    assert not remade(before, cache_entries(output))
    assert results(output) == first


def test_centers_that_are_followed_by_group_give_groups_and_a_warning(two_balls, tmp_path):
    warnings = finish(two_balls, tmp_path, segments="long", tracking="group", group_size=2, until="reference")
    assert runs(tmp_path) == [[3, 4], [5]]
    assert any("--tracking group" in line for line in warnings)
