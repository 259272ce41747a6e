"""Runs of frames that share one mesh: how long they are, why they end, and what a second run computes again."""

import numpy as np
import pytest
import trimesh

from refmesh_addon.core.deformation.deformer import deform_reference
from refmesh_addon.core.settings import Settings
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.pc2 import read_pc2
from refmesh_addon.pipeline.run import run
from refmesh_addon.pipeline.session.job import JobSpec
from refmesh_addon.pipeline.stages.groups import FrameGroup
from refmesh_addon.pipeline.stages.reference import GroupedFrames
from refmesh_addon.pipeline.stages.segment_review import AFTER_OWN, EXTRA, LEAST_EXTRA, OWN_MESH, cuts_around
from refmesh_addon.pipeline.stages.segments import FINAL, PROBED, SegmentPlan

from .conftest import FRAMES, TINY
from .running import cache_entries, finish, remade, report, results, shared_workers


def runs(output):
    return [group["frames"] for group in report(output)["groups"]]


class CountingWorkers:
    """The shared processes, and how many frames they have deformed."""

    def __init__(self):
        self.count, self.fit_memory, self.deformed = shared_workers().count, shared_workers().fit_memory, 0

    def map(self, function, tasks, poll):
        for outcome in shared_workers().map(function, tasks, poll):
            self.deformed += function is deform_reference
            yield outcome


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
    settings, workers = Settings.from_flat({**TINY.to_flat(), "segments": "long", "group_size": 2}), CountingWorkers()
    run(JobSpec(str(ball_to_ring), str(tmp_path), settings=settings), lambda *_: None, lambda _: None, workers)
    assert 4 in [frames[0] for frames in runs(tmp_path)]
    assert len(runs(tmp_path)) < 4, "fewer meshes than groups"
    reason = next(group["reason"] for group in report(tmp_path)["groups"] if group["frames"][0] == 4)
    assert reason.startswith("one mesh does not serve both sides: frame") and "%" in reason
    assert [frame["number"] for frame in report(tmp_path)["frames"]] == list(range(8))
    assert workers.deformed <= 8 + max(EXTRA * 8, LEAST_EXTRA) + len(runs(tmp_path)) - 1, "with hand-overs"


def test_a_group_with_a_mesh_of_its_own_leaves_the_mesh_of_its_run_to_the_frames_around_it():
    run = FrameGroup(0, tuple(range(10)), None, "key", tuple(range(10)), segment=True)
    plan = SegmentPlan(GroupedFrames((run,), None), ("the take begins",), PROBED)
    cuts = cuts_around(plan, {(0, 1): OWN_MESH + "a", (4, 5): OWN_MESH + "b", (6, 7): OWN_MESH + "c"}, spent=6)
    assert cuts.starts.tolist() == [0, 2, 4, 6, 8]
    assert cuts.sources.tolist() == [[0, 2], [0, 10], [4, 6], [6, 8], [0, 10]]
    assert cuts.reasons == (OWN_MESH + "a", AFTER_OWN + "a", OWN_MESH + "b", OWN_MESH + "c", AFTER_OWN + "c")
    assert (cuts.state, cuts.spent) == (FINAL, 6)


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
