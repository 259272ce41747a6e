"""What the panel says of each step: never run, up to date, or stale and why."""

from __future__ import annotations

import json

import pytest

from refmesh_addon.bridge.results.status import export_note, first_to_run, step_status, used_settings
from refmesh_addon.core.options import label_of, value_label
from refmesh_addon.core.settings import STAGES, flat_fields
from refmesh_addon.ui.layout import describe_seconds


def kinds(state) -> list[str]:
    return [step_status(state, stage).kind for stage in STAGES]


def test_nothing_ran_yet(ball):
    assert kinds(ball.refmesh) == ["never"] * 5
    assert first_to_run(ball.refmesh, "evaluation") == "Track"


def test_loaded_results_are_up_to_date(solved):
    assert kinds(solved.refmesh) == ["current"] * 4 + ["never"] and first_to_run(solved.refmesh, "evaluation") == ""


@pytest.mark.parametrize(
    "setting, value, expected",
    [
        ("centers", 77, "stale stale stale stale"),
        ("mapping", "rbf", "current stale stale stale"),
        ("fit_rounds", 2, "current current stale stale"),
        ("samples", 200, "current current current stale"),
    ],
)
def test_a_changed_setting_makes_stale_what_depends_on_it(solved, setting, value, expected):
    state = solved.refmesh
    before = getattr(state.settings, setting)
    setattr(state.settings, setting, value)
    assert kinds(state) == [*expected.split(), "never"]
    stale = next(step_status(state, stage) for stage in STAGES if step_status(state, stage).kind == "stale")
    item = next(item for item in flat_fields() if item.name == setting)
    assert f"{label_of(item)} was {value_label(item, before)}, is {value_label(item, value)} now" in stale.text
    setattr(state.settings, setting, before)
    assert kinds(state) == ["current"] * 4 + ["never"]


def test_every_changed_setting_is_named(solved):
    state = solved.refmesh
    state.settings.centers, state.settings.resolution, state.settings.mapping = 77, 99, "rbf"
    text = step_status(state, "reference").text
    assert all(label in text for label in ("Detail was 1000, is 77", "Voxel Resolution was 256, is 99", "Mapping was Affinity, is RBF"))
    assert "Mapping" not in step_status(state, "tracking").text


def test_an_export_says_when_it_holds_the_meshes_of_other_settings(solved):
    assert export_note(solved.refmesh) == ""
    solved.refmesh.settings.samples = 200  # matters to the figures, not to the meshes
    assert export_note(solved.refmesh) == ""
    solved.refmesh.settings.fit_rounds = 2
    assert "Holds the meshes of the last run" in export_note(solved.refmesh) and "Fit Rounds was 6, is 2" in export_note(solved.refmesh)


def test_another_choice_of_frames_makes_everything_stale(solved):
    solved.refmesh.frame_selection = "6-8"
    assert kinds(solved.refmesh) == ["stale"] * 4 + ["never"]


def test_groups_matter_to_tracking_where_it_starts_anew_with_each(solved):
    state = solved.refmesh
    results = json.loads(state.results)
    state.settings.tracking = results["settings"]["tracking"] = "group"
    state.results = json.dumps(results)
    state.settings.group_size = 3
    assert kinds(state) == ["stale"] * 4 + ["never"]


def test_a_step_taken_from_the_cache_keeps_its_time(solved):
    state = solved.refmesh
    settings = state.settings.to_flat()
    state.results = used_settings(state, {"tracking": 12.0, "reference": 5.0}, settings)
    state.results = used_settings(state, {"tracking": 0.1, "reference": 0.2, "deformation": 3.0}, settings | {"mapping": "rbf"})
    assert json.loads(state.results)["seconds"] == {"tracking": 12.0, "reference": 0.2, "deformation": 3.0}


def test_results_of_some_frames_choose_those_frames(blender, ball, results):
    report = json.loads((results / "report.json").read_text())
    report["sequence"]["numbers"] = [6, 7, 8, 11]
    (results / "report.json").write_text(json.dumps(report))
    blender.ops.refmesh.load_results(output=str(results))
    assert ball.refmesh.frame_selection == "6-8,11" and kinds(ball.refmesh) == ["current"] * 4 + ["never"]
    ball.refmesh.frame_selection = "6,7-8,11"
    blender.ops.refmesh.load_results(output=str(results))
    assert ball.refmesh.frame_selection == "6,7-8,11"


def test_times_are_readable():
    assert [describe_seconds(seconds) for seconds in (0.42, 12.3, 80, 3601)] == ["0.4 s", "12 s", "1:20 min", "60:01 min"]
