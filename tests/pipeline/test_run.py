"""Whole runs: same bytes whatever the circumstances, and only the work that is needed."""

import json

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.core.errors import Canceled
from refmesh_addon.core.geometry.mesh import is_watertight
from refmesh_addon.core.settings import Settings
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.pc2 import read_pc2
from refmesh_addon.pipeline.run import run
from refmesh_addon.pipeline.session.job import STAGES, JobSpec
from refmesh_addon.pipeline.session.parallel import Workers

from .conftest import FRAMES, TINY
from .running import cache_entries, finish, remade, report, results, stages_of


def test_the_report_names_what_is_there(finished):
    found = report(finished)
    files = {str(path.relative_to(finished)) for path in finished.rglob("*") if path.is_file() and "cache" not in path.parts}
    named = {"report.json", "centers.npz", found["centers_playback"]}
    named |= {group[name] for group in found["groups"] for name in ("reference", "playback")}
    named |= {frame["deformed"] for frame in found["frames"]}
    assert files == named
    assert tuple(found["seconds"]) == STAGES
    assert [frame["number"] for frame in found["frames"]] == list(FRAMES)


def test_deformed_frames_share_the_reference_and_are_what_is_played(finished):
    found = report(finished)
    reference = read_mesh(finished / found["groups"][0]["reference"])
    assert is_watertight(reference)
    assert found["groups"][0]["components"] == 2
    played = list(read_pc2(finished / found["groups"][0]["playback"]))
    for frame, shown in zip(found["frames"], played, strict=True):
        deformed = read_mesh(finished / frame["deformed"])
        assert_array_equal(deformed.triangles, reference.triangles)
        assert_array_equal(shown, deformed.vertices.astype(np.float32))
        assert max(frame[side]["mean"] for side in ("source_to_deformed", "deformed_to_source")) < 0.05


def test_what_was_known_before_the_run_is_reported_with_its_own_warnings(two_balls, tmp_path):
    assert "said before" in finish(two_balls, tmp_path, warnings=("said before",), until="tracking")
    assert "said before" in report(tmp_path)["warnings"]


@pytest.mark.parametrize("tracking", ["sequence", "group"])
def test_the_number_of_workers_changes_no_byte(two_balls, tmp_path, tracking):
    settings = Settings.from_flat({**TINY.to_flat(), "tracking": tracking, "group_size": 2})
    for workers in (1, 2):
        spec = JobSpec(str(two_balls), str(tmp_path / str(workers)), settings=settings)
        with Workers(workers) as own:
            run(spec, lambda *_: None, lambda _: None, own)
    assert results(tmp_path / "1") == results(tmp_path / "2")


def test_a_second_run_makes_nothing_and_writes_the_same(output, finished, two_balls):
    before = cache_entries(output)
    finish(two_balls, output)
    assert cache_entries(output) == before
    assert results(output) == results(finished)


def test_results_that_were_deleted_come_back_from_the_cache(output, finished, two_balls):
    before = cache_entries(output)
    for path in (output / "centers.npz", output / "report.json", output / "deformed" / "frame_0004.ply"):
        path.unlink()
    finish(two_balls, output)
    assert cache_entries(output) == before
    assert results(output) == results(finished)


@pytest.mark.parametrize(
    ("changes", "stages"),
    [
        ({"samples": 500}, {"evaluation"}),
        ({"fit_rounds": 2}, {"deformation", "evaluation"}),
        ({"triangles": 400}, {"reference", "deformation", "evaluation"}),
        ({"centers": 47}, {"tracking", "reference", "deformation", "evaluation"}),
    ],
    ids=lambda value: "-".join(value),
)
def test_a_changed_setting_remakes_its_stage_and_what_follows(output, finished, two_balls, changes, stages):
    before = cache_entries(output)
    finish(two_balls, output, **changes)
    after = cache_entries(output)
    assert stages_of(remade(before, after)) == stages
    assert set(after) == set(before), "entries of the old settings are gone"
    assert report(output)["settings"] == {**TINY.to_flat(), **changes}
    assert results(output) != results(finished)


def stop_at(stage, count):
    """A `notify` that gives up at the count-th report of a stage."""
    seen = []

    def notify(reported, *_):
        seen.append(reported)
        if seen.count(stage) == count:
            raise Canceled

    return notify


def test_a_run_stopped_again_and_again_ends_with_the_same_bytes(finished, two_balls, tmp_path):
    """Stopped before its first frame, after some frames, and within each later stage."""
    left = {}
    for stage, count in [("tracking", 2), ("tracking", 6), ("reference", 3), ("deformation", 3), ("evaluation", 3)]:
        with pytest.raises(Canceled):
            finish(two_balls, tmp_path, stop_at(stage, count))
        assert not list(tmp_path.rglob("*.refmesh-partial"))
        entries = cache_entries(tmp_path)
        assert not set(left) & remade(left, entries) - {"tracking/state"}, "what was done is not done again"
        left = entries
    finish(two_balls, tmp_path)
    assert results(tmp_path) == results(finished)


def test_stages_that_are_not_wanted_are_not_run(two_balls, tmp_path, finished):
    for until in STAGES[:-1]:
        finish(two_balls, tmp_path, until=until)
        wanted = STAGES[: STAGES.index(until) + 1]
        found = report(tmp_path)
        assert tuple(found["seconds"]) == wanted
        assert stages_of(set(cache_entries(tmp_path))) == {"frames", *wanted}
        assert bool(found["groups"]) == ("reference" in wanted)
        assert bool(found["frames"]) == ("deformation" in wanted)
        assert all(("source_to_deformed" in frame) == ("evaluation" in wanted) for frame in found["frames"])
        assert found["tracking"] == report(finished)["tracking"]


def test_fewer_frames_leave_no_results_of_the_others(output, two_balls):
    finish(two_balls, output, frames="3-4")
    assert {path.name for path in (output / "deformed").iterdir()} == {"frame_0003.ply", "frame_0004.ply"}
    assert len(list((output / "playback").iterdir())) == 2
    assert report(output)["sequence"]["numbers"] == [3, 4]
    assert np.load(output / "centers.npz")["positions"].shape[0] == 2


def test_smaller_groups_replace_the_larger_ones(output, two_balls):
    finish(two_balls, output, group_size=2)
    assert [group["frames"] for group in report(output)["groups"]] == [[3, 4], [5]]
    assert {path.name for path in (output / "reference").iterdir()} == {"group_000.ply", "group_001.ply"}
    assert len(list((output / "playback").glob("group_*.pc2"))) == 2
    with np.load(output / "centers.npz") as centers:
        assert len(centers["group_001_reference_centers"]) == TINY.tracking.centers
    finish(two_balls, output, until="reference")
    assert {path.name for path in (output / "reference").iterdir()} == {"group_000.ply"}


def test_progress_names_stages_in_order_and_shares_from_zero_to_one(output, two_balls):
    seen = []
    finish(two_balls, output, lambda stage, frame, share, *_: seen.append((stage, frame, share)), resume=False)
    assert tuple(dict.fromkeys(stage for stage, _, _ in seen)) == STAGES
    assert all(0 <= share <= 1 for _, _, share in seen)
    for stage in STAGES:
        assert {frame for name, frame, _ in seen if name == stage and frame is not None} <= set(FRAMES)
    assert {frame for name, frame, _ in seen if name == "tracking"} >= set(FRAMES)


def test_each_group_can_be_played_while_the_others_are_deformed(output, two_balls, finished):
    """In any order, and nothing comes out differently for it."""
    seen, playable = [], {}

    def ready(index):
        group = report(output)["groups"][index]
        playable[index] = (output / group["playback"]).is_file() and (output / group["reference"]).is_file()
        seen.append(index)

    finish(two_balls, output, lambda stage, *_: seen.append(stage), resume=False, group_size=2, group_ready=ready)
    assert playable == {0: True, 1: True}
    assert seen.index(0) < len(seen) - 1 - seen[::-1].index("deformation") and "evaluation" not in seen[: seen.index(1)]
    once = results(output)
    finish(two_balls, output, resume=False, group_size=2)
    assert results(output) == once


def test_the_report_is_plain_json(finished):
    text = (finished / "report.json").read_text(encoding="utf-8")
    assert json.dumps(json.loads(text), allow_nan=False)
    assert str(finished) not in text, "paths of results are relative to the output folder"


def test_material_points_travel_with_their_body(finished):
    """The balls move by a tenth of their radius toward each other from frame to frame, and so does every vertex."""
    frames = [read_mesh(finished / frame["deformed"]).vertices for frame in report(finished)["frames"]]
    side = np.sign(frames[0][:, :1])
    for step in (1, 2):
        error = np.linalg.norm(frames[step] - frames[0] + 0.1 * step * side * [1.0, 0.0, 0.0], axis=1)
        assert np.median(error) < 0.1, "a fifth of the spacing of the centers"
