"""How frames are grouped, which of them count for the surface, and how groups hand over."""

import numpy as np
import pytest
import trimesh

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.geometry.mesh import sample_surface
from refmesh_addon.io.frame_range import format_ranges
from refmesh_addon.io.meshes import read_mesh

from .conftest import FRAMES
from .running import finish, report, results


@pytest.fixture(scope="module")
def balls_with_a_newcomer(tmp_path_factory):
    """A ball alone for three frames, then with another one far off for three."""
    folder = tmp_path_factory.mktemp("newcomer")
    for number in range(6):
        bodies = [trimesh.creation.icosphere(subdivisions=2).apply_translation([0.05 * number, 0, 0])]
        if number >= 3:
            bodies.append(trimesh.creation.icosphere(subdivisions=2).apply_translation([4.0, 0, 0]))
        trimesh.util.concatenate(bodies).export(folder / f"ball_{number}.obj")
    return folder


@pytest.fixture(scope="module")
def ball_then_ring(tmp_path_factory):
    """A ball for three frames, then for three a ring of the same volume: they cannot be aligned."""
    folder = tmp_path_factory.mktemp("ring")
    for number in range(6):
        body = trimesh.creation.icosphere(subdivisions=3) if number < 3 else trimesh.creation.torus(1.0, np.sqrt(4 / (6 * np.pi)))
        body.apply_translation([0.02 * number, 0, 0]).export(folder / f"ball_{number}.obj")
    return folder


def test_balls_that_only_move_are_one_group(two_balls, tmp_path):
    finish(two_balls, tmp_path, group_size=0, until="reference", centers=200, resolution=64)
    assert [group["frames"] for group in report(tmp_path)["groups"]] == [list(FRAMES)]


def test_groups_by_content_are_no_longer_than_asked(two_balls, tmp_path):
    finish(two_balls, tmp_path, group_size=0, longest_group=2, until="reference")
    assert sorted(len(group["frames"]) for group in report(tmp_path)["groups"]) == [1, 2]


def test_a_group_begins_where_something_appears(balls_with_a_newcomer, tmp_path):
    for group_size in (0, 6):
        finish(balls_with_a_newcomer, tmp_path / str(group_size), group_size=group_size, until="reference")
        assert 3 in [group["frames"][0] for group in report(tmp_path / str(group_size))["groups"]]


def test_groups_by_content_need_the_whole_take_tracked(two_balls, tmp_path):
    with pytest.raises(RefMeshError, match="--tracking sequence"):
        finish(two_balls, tmp_path, group_size=0, tracking="group")


@pytest.mark.parametrize("tracking", ["sequence", "group"])
def test_each_group_but_the_last_is_carried_into_the_next(two_balls, tmp_path, tracking):
    finish(two_balls, tmp_path, group_size=2, tracking=tracking)
    first, last = report(tmp_path)["groups"]
    assert 0 <= first["handover"]["mean"] <= first["handover"]["max"] < 0.05
    assert "handover" not in last
    assert [frame["number"] for frame in report(tmp_path)["frames"]] == list(FRAMES)


def test_a_resumed_run_hands_over_the_same(two_balls, tmp_path):
    finish(two_balls, tmp_path / "out", group_size=2)
    before = results(tmp_path / "out")
    finish(two_balls, tmp_path / "out", group_size=2)
    assert results(tmp_path / "out") == before


def test_frames_that_cannot_be_aligned_are_named_and_leave_no_trace_in_the_surface(ball_then_ring, tmp_path):
    """The group is as the frames say that look like its anchor."""
    settings = {"group_size": 6, "until": "reference"}
    warnings = finish(ball_then_ring, tmp_path / "out", **settings)
    (group,) = report(tmp_path / "out")["groups"]
    assert group["left_out"] and group["anchor"] not in group["left_out"]
    alike = {0, 1, 2} if group["anchor"] < 3 else {3, 4, 5}
    assert set(group["left_out"]) >= set(range(6)) - alike
    named = f"in {len(group['left_out'])} of 6 frames: {format_ranges(group['left_out'])}) and does not count for the reference mesh"
    assert any(named in line for line in warnings)
    anchor = read_mesh(ball_then_ring / f"ball_{group['anchor']}.obj")
    reference = read_mesh(tmp_path / "out" / group["reference"])
    points, _ = sample_surface(reference, 500, np.random.default_rng(0))
    assert SurfaceIndex(anchor).query(points).distances.max() < 0.25


def test_all_frames_count_when_nothing_is_asked_of_them(ball_then_ring, tmp_path):
    finish(ball_then_ring, tmp_path, group_size=6, least_overlap=0.0, until="reference")
    (group,) = report(tmp_path)["groups"]
    assert group["left_out"] == []


def test_near_stress_gives_other_centers(two_balls, tmp_path):
    found = {}
    for stress in ("plain", "near"):
        finish(two_balls, tmp_path / stress, stress=stress, until="reference")
        found[stress] = np.load(tmp_path / stress / "centers.npz")["group_000_reference_centers"]
    assert not np.allclose(found["plain"], found["near"])
