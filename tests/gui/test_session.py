"""A whole session in a real Blender with a window.

BLENDER_WINDOW names the program, which may be a script that starts it elsewhere, in BLENDER_SCRATCH where it sees only that folder;
BLENDER_ZIP the extension that is installed first, else the add-on of this checkout is registered.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import time
from pathlib import Path

import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.pipeline.process.lock import output_lock

ROOT = Path(__file__).resolve().parents[2]
SAMPLE = ROOT / "sample_scenes" / "grasp" / "frames"
FRAMES = range(40, 46)
SECONDS_TO_END = 15.0
TIME_LIMIT = 900.0


@pytest.fixture(scope="module")
def session(tmp_path_factory) -> dict:
    """What the session saw; skipped where no Blender with a window can be had."""
    program = os.environ.get("BLENDER_WINDOW") or shutil.which("blender")
    if not program:
        pytest.skip("there is no Blender: put one on PATH, or name one with BLENDER_WINDOW")
    screen = [] if os.environ.get("DISPLAY") or os.environ.get("BLENDER_WINDOW") else [shutil.which("xvfb-run"), "-a"]
    if None in screen:
        pytest.skip("there is no display, and no xvfb-run to make one")
    folder = Path(os.environ.get("BLENDER_SCRATCH") or tmp_path_factory.mktemp("session"))
    shutil.rmtree(folder, ignore_errors=True)
    frames, output = folder / "frames", folder / "out"
    for folder in (frames, output):
        folder.mkdir(parents=True)
    for number in FRAMES:
        shutil.copy(SAMPLE / f"grasp_{number:04d}.obj", frames)
    archive = [os.environ["BLENDER_ZIP"]] if "BLENDER_ZIP" in os.environ else []
    script = str(ROOT / "tests" / "gui" / "session.py")
    command = [*screen, program, "--factory-startup", "--enable-event-simulate", "-P", script, "--", str(frames), str(output), *archive]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=TIME_LIMIT)
    record = output / "session.json"
    assert record.is_file(), ended.stdout[-2000:] + ended.stderr[-2000:]
    seen = json.loads(record.read_text())
    if seen.get("lacking"):
        pytest.skip(f"this Blender's Python lacks {', '.join(seen['lacking'])}")
    return seen | {"output": output}


def test_nothing_went_wrong_on_the_way(session):
    assert session.get("trouble") is None, session["trouble"]
    assert session["troubles"] == []


def test_frames_come_in_by_the_file_browser_and_are_checked(session):
    assert session["imported"] == [str(number) for number in FRAMES] and session["checked"]


def test_escape_over_the_panel_ends_a_job_at_once_and_leaves_no_objects(session):
    assert session["objects_after_cancel"] == ["grasp", "grasp source"]
    assert "tracking" in session["status"]


def test_escape_in_the_view_is_not_meant_for_the_job(session):
    assert session["runs_on_after_escape_in_the_view"]


def test_nothing_else_changes_the_scene_while_a_job_runs(session):
    assert session["allowed_while_running"] == []


def test_bodies_are_marked_in_edit_mode(session):
    assert session["marked"] == 2 and session["mode_after_marking"] == "EDIT_MESH"


def test_everything_is_made_and_one_undo_takes_it_back(session):
    assert session["done"] == ["color", "deformation", "evaluation", "reference", "tracking"]
    assert session["objects_after_undo"] == ["grasp", "grasp source"] and session["redo_brings_all_back"]


def test_a_moved_scene_opens_with_its_results(session):
    reopened = session["reopened"]
    assert reopened["done"] == ["color", "deformation", "evaluation", "reference", "tracking"]
    assert reopened["cache"].startswith("//") and reopened["output"].startswith("//")
    assert session["shown_after_reopening"] == str(FRAMES[-1])


def test_results_go_out(session):
    assert session["exported"] == ["grasp.glb"]


def test_closing_blender_ends_the_worker(session):
    """Its lock is free soon: the worker ends at its next step, and the system lets go of what it held."""
    assert session["lock_at_quit"]
    output = session["output"] / "unfinished"
    end = time.monotonic() + SECONDS_TO_END
    while True:
        try:
            with output_lock(output / "cache", output):
                return
        except RefMeshError:
            assert time.monotonic() < end, "the worker still runs"
            time.sleep(0.2)
