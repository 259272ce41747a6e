"""Folders of results from elsewhere, damaged in any file: shown, or refused in words, and never a traceback."""

import json
import os
import shutil

import bpy
import numpy as np
import pytest

from tests.fuzzing.inputs import altered

DAMAGED = int(os.environ.get("REFMESH_DAMAGED_RESULTS", "60"))  # folders
PLAYBACK = ("playback/group_000-0.pc2", "playback/centers-0.pc2")
FILES = ("report.json", "centers.npz", "reference/group_000.ply", *PLAYBACK, "deformed/frame_0006.ply")
ODD = ["", "x", "[]", "[" * 100_000, '{"settings": 3}', '{"settings": {}, "frames": "", "seconds": {"tracking": "x"}}']


def attempt(operator, **arguments):
    """Runs an operator; a refusal has one line of words."""
    try:
        getattr(bpy.ops.refmesh, operator)(**arguments)
    except RuntimeError as error:
        assert "Traceback" not in str(error), str(error)
        return "refused"
    return "done"


def test_damaged_folders_are_shown_or_refused_in_words(blender, ball, results, tmp_path):
    rng, outcomes = np.random.default_rng(20), []
    for number in range(DAMAGED):
        folder = tmp_path / f"damaged_{number}"
        shutil.copytree(results, folder)
        name = FILES[rng.integers(len(FILES)) if rng.random() < 0.6 else 0]
        (folder / name).write_bytes(altered("report" if name.endswith(".json") else "result", (folder / name).read_bytes(), rng))
        outcomes.append(attempt("load_results", output=str(folder)))
        outcomes.append(attempt("export", format="pc2", directory=str(tmp_path / "export")))
        ball.refmesh.output = str(folder)
        outcomes.append(attempt("export", format="ply", directory=str(tmp_path / "export")))
        bpy.context.scene.frame_set(7)
        shutil.rmtree(folder)
    assert "refused" in outcomes and "done" in outcomes


@pytest.mark.parametrize("text", ODD)
def test_a_scene_with_odd_notes_on_its_results_says_not_run(blender, solved, text):
    from refmesh_addon.bridge.results.status import step_status

    solved.refmesh.results = text
    assert step_status(solved.refmesh, "tracking").kind in ("current", "stale")


def test_results_that_name_a_mesh_elsewhere_do_not_open_it(blender, ball, results, tmp_path):
    (tmp_path / "private.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    report = json.loads((results / "report.json").read_text())
    report["settings"]["mesh"] = str(tmp_path / "private.obj")
    (results / "report.json").write_text(json.dumps(report))
    blender.ops.refmesh.load_results(output=str(results))
    assert ball.refmesh.own_mesh is None and len(ball.refmesh.groups[0].reference.data.vertices) > 3


def test_an_export_does_not_replace_the_capture(blender, solved, results, frames, tmp_path):
    (tmp_path / "mine").mkdir()
    first = frames / "ball_0006.obj"
    os.link(first, tmp_path / "mine" / "ball.glb")
    before = first.read_bytes()
    assert attempt("export", format="glb", directory=str(tmp_path / "mine")) == "refused"
    assert first.read_bytes() == before and attempt("export", format="glb", directory=str(tmp_path / "other")) == "done"


def test_a_frame_of_the_same_size_and_time_makes_results_out_of_date(blender, solved, results, frames):
    from refmesh_addon.bridge.results.freshness import fingerprint

    before, path = fingerprint(solved, results), frames / "ball_0007.obj"
    assert before and fingerprint(solved, results) == before
    times, data = path.stat(), path.read_bytes()
    path.write_bytes(data.replace(b"1", b"2", 1))
    os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
    assert path.stat().st_size == times.st_size and fingerprint(solved, results) != before


def test_a_scene_that_names_a_folder_writes_nothing_there(blender, ball, tmp_path):
    elsewhere = tmp_path / "elsewhere"
    (elsewhere / "cache" / "preview").mkdir(parents=True)
    ball.refmesh.output = str(elsewhere)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    for frame in (6, 7, 10):
        bpy.context.scene.frame_set(frame)
    assert [path.name for path in elsewhere.rglob("*") if path.is_file()] == []
