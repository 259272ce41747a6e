"""Jobs: how arguments, preset and panel make up the settings, and what a job does to the scene."""

from __future__ import annotations

import json
from types import SimpleNamespace

import bpy
import pytest

from refmesh_addon.core.presets import PRESETS
from refmesh_addon.core.settings import Settings
from refmesh_addon.operators.progress import Clock, minutes, stage_and_frame
from refmesh_addon.operators.settings import chosen_settings, settings_warnings
from refmesh_addon.pipeline.process import presets

# As little work as the pipeline can do on a coarse ball.
TINY = {"segments": "groups", "centers": 16, "resolution": 16, "group_size": 3, "alignment_steps": 0, "triangles": 300}
TINY |= {"fit_rounds": 1, "arap_iterations": 1, "samples": 100}

STEPS = {"track": "tracking", "extract_reference": "reference", "deform": "deformation", "evaluate": "evaluation", "color": "color"}


def settings_of(panel: Settings, **passed) -> Settings:
    """What a job would run with: the operator's arguments as a script passes them, on top of a panel."""
    owner = bpy.context.active_object
    owner.refmesh.settings.assign(panel.to_flat())
    arguments = bpy.context.window_manager.operator_properties_last("refmesh.run_all")
    for name in list(arguments.bl_rna.properties.keys()):
        arguments.property_unset(name)
    for name, value in passed.items():
        setattr(arguments, name, value)
    return chosen_settings(arguments, owner.refmesh.settings)


def test_defaults_of_a_new_sequence_are_those_of_the_core(ball):
    assert settings_of(Settings()) == Settings()
    assert ball.refmesh.settings.matching_preset() == "standard"


def test_what_is_passed_wins_over_preset_wins_over_panel(ball):
    panel = Settings.from_flat({"centers": 77, "resolution": 99, "smoothness": 0.3})
    assert settings_of(panel) == panel
    assert settings_of(panel, centers=88) == Settings.from_flat({"centers": 88, "resolution": 99, "smoothness": 0.3})
    assert settings_of(panel, preset="draft") == Settings.from_flat(PRESETS["draft"])
    assert settings_of(panel, preset="draft", centers=1000) == Settings.from_flat({**PRESETS["draft"], "centers": 1000})


def test_without_pymeshlab_the_paper_preset_falls_back_and_says_so(ball, monkeypatch):
    monkeypatch.setattr(presets, "_is_installed", lambda: False)
    arguments = bpy.context.window_manager.operator_properties_last("refmesh.run_all")
    expected = Settings.from_flat({**PRESETS["paper"], "reconstruction": "builtin"})
    assert settings_of(Settings(), preset="paper") == expected
    assert "PyMeshLab is not installed" in settings_warnings(arguments)[0]
    bpy.ops.refmesh.apply_preset(preset="paper")
    assert Settings.from_flat(ball.refmesh.settings.to_flat()) == expected and ball.refmesh.settings.matching_preset() == "paper"
    assert settings_of(Settings(), preset="paper", reconstruction="pymeshlab") == Settings.from_flat(PRESETS["paper"])
    assert settings_warnings(arguments) == ()  # the job itself refuses what it is asked for by name


@pytest.mark.parametrize("preset", PRESETS)
def test_preset_button_sets_the_panel(ball, preset):
    bpy.ops.refmesh.apply_preset(preset=preset)
    assert Settings.from_flat(ball.refmesh.settings.to_flat()) == Settings.from_flat(PRESETS[preset])
    assert ball.refmesh.settings.matching_preset() == preset


def test_run_all_leaves_results_objects_and_its_settings(ball, tmp_path):
    output = tmp_path / "new" / "out"
    assert bpy.ops.refmesh.run_all(output=str(output), quiet=True, **TINY) == {"FINISHED"}
    report = json.loads((output / "report.json").read_text())
    assert [frame["number"] for frame in report["frames"]] == [6, 7, 8, 10, 11]
    assert ball.refmesh.done == {"tracking", "reference", "deformation", "evaluation", "color"}
    assert ball.refmesh.centers and all(group.deformed and group.reference for group in ball.refmesh.groups)
    assert Settings.from_flat(ball.refmesh.settings.to_flat()) == Settings.from_flat(TINY)
    assert ball.refmesh.output == str(output)


def test_steps_reach_their_stage_and_no_further(ball, tmp_path):
    expected = set()
    for operator, stage in STEPS.items():
        getattr(bpy.ops.refmesh, operator)(output=str(tmp_path / "out"), quiet=True, frames="6-8", **TINY)
        expected.add(stage)
        assert ball.refmesh.done == expected


@pytest.mark.parametrize(
    "change, message",
    [
        (lambda folder: (folder / "ball_0008.obj").write_text("this is no mesh"), "ball_0008.obj"),
        (lambda folder: (folder / "ball_0008.obj").unlink(), "frame 8"),
        (lambda folder: [path.unlink() for path in folder.iterdir()], "no meshes found"),
    ],
)
def test_a_job_that_fails_says_which_file_and_changes_nothing(ball, frames, tmp_path, change, message):
    ball.refmesh.frame_selection = "6-8"
    change(frames)
    before = set(bpy.data.objects)
    with pytest.raises(RuntimeError, match=message) as failure:
        bpy.ops.refmesh.run_all(output=str(tmp_path / "out"), quiet=True, **TINY)
    assert "Traceback" not in str(failure.value) and len(str(failure.value).strip().splitlines()) == 1
    assert set(bpy.data.objects) == before


def test_frames_that_were_not_imported_are_refused(blender, frames, tmp_path):
    blender.ops.refmesh.import_sequence(filepath=str(frames), frames="6-7")
    with pytest.raises(RuntimeError, match="not part of the sequence yet: frame 8; press 'Reload Frames'"):
        blender.ops.refmesh.run_all(output=str(tmp_path / "out"), frames="6-8", quiet=True)
    assert not (tmp_path / "out").exists()


def described(event) -> str:
    clock = Clock()
    clock.hear(event)
    return clock.describe()


def test_progress_is_described():
    event = SimpleNamespace(stage="tracking", frame=8, share=0.25, left=80.4)
    assert stage_and_frame(event) == "tracking, frame 8"
    assert stage_and_frame(SimpleNamespace(stage="reference", frame=None)) == "reference"
    assert described(event) == "tracking, frame 8, 25.0%, 1:20 left"
    assert described(SimpleNamespace(stage="tracking", frame=None, share=0.0, left=None)) == "tracking, 0.0%"
    assert [minutes(seconds) for seconds in (0, 59.9, 61, 3600)] == ["0:00", "0:59", "1:01", "60:00"]
