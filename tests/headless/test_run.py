"""The headless entry as a person starts it: in a process of its own."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import bpy
import numpy as np
import pytest

from refmesh_addon.core.presets import PRESETS
from refmesh_addon.core.settings import flat_fields
from refmesh_addon.io.ply import read_surface

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "headless" / "run.py"
TINY = "--segments groups --centers 16 --resolution 16 --group-size 2 --alignment-steps 0 --triangles 300".split()
TINY += "--fit-rounds 1 --arap-iterations 1 --samples 100".split()


def run(*arguments, **options) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, str(SCRIPT), *map(str, arguments)], capture_output=True, text=True, **options)


@pytest.fixture
def frames(tmp_path) -> Path:
    """Three boxes that grow, numbered from 20."""
    folder = tmp_path / "box"
    folder.mkdir()
    faces = "1 2 4 3,5 7 8 6,1 5 6 2,3 4 8 7,1 3 7 5,2 6 8 4".split(",")
    for number in (20, 21, 22):
        size = 1 + 0.02 * number
        corners = [f"v {x * size} {y} {z}" for x in (0, 1) for y in (0, 1) for z in (0, 1)]
        (folder / f"box_{number}.obj").write_text("\n".join(corners + [f"f {face}" for face in faces]) + "\n")
    return folder


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_an_interrupted_run_says_how_to_continue(frames, tmp_path):
    command = [sys.executable, str(SCRIPT), str(frames), "--output", str(tmp_path / "out")]
    heed = partial(signal.signal, signal.SIGINT, signal.default_int_handler)  # which a background job of a shell ignores
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, preexec_fn=heed) as process:
        said = process.stderr.read(1)  # of the progress bar
        process.send_signal(signal.SIGINT)
        said += process.stderr.read()
    assert (process.returncode, b"Traceback" in said) == (130, False), said
    assert said.decode().splitlines()[-1].startswith("interrupted: ")


def test_everything_asked_for_is_written_and_listed(frames, tmp_path):
    """From another folder, with relative paths; a second run with the same command takes up what is there."""
    command = ["box", "--frames", "20-21", "--output", "out", *TINY, "--export", "pc2", "--export", "ply", "--export", "abc"]
    first = run(*command, cwd=tmp_path)
    assert (first.returncode, "Traceback" in first.stderr) == (0, False), first.stderr
    assert "tracking" in first.stderr and "%" in first.stderr
    listed = [tmp_path / line for line in first.stdout.splitlines()]
    assert all(path.is_file() for path in listed)
    names = {str(path.relative_to(tmp_path / "out")) for path in listed}
    assert names >= {"report.json", "centers.npz", "scene.blend", "reference/group_000.ply", "export/box.abc", "export/box_group_000.pc2"}
    assert {"deformed/frame_0020.ply", "deformed/frame_0021.ply", "export/ply/frame_0020.ply"} <= names
    assert json.loads((tmp_path / "out" / "report.json").read_text())["settings"]["centers"] == 16
    before = {path: path.read_bytes() for path in listed if path.suffix in (".ply", ".npz", ".pc2")}
    assert "MB for later runs; --clean-cache removes them" in first.stderr.splitlines()[-1]
    second = run(*command, "--quiet", "--clean-cache", cwd=tmp_path)
    assert (second.returncode, second.stdout, second.stderr) == (0, "", "")
    assert {path: path.read_bytes() for path in before} == before
    assert {path.parent.name for path in (tmp_path / "out" / "cache").rglob("*.npz")} == {"preview"}


def test_a_job_for_a_render_farm_is_written_and_nothing_is_run(frames, tmp_path):
    options = ["--centers", "16", "--export", "usd", "--preview", "p.png"]
    done = run("box", *options, "--output", "out", "--export-job", "openjd", "job", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert {Path(line).name for line in done.stdout.splitlines()} == {path.name for path in (tmp_path / "job").iterdir()}
    job = json.loads((tmp_path / "job" / "job.json").read_text())
    assert (job["source"], job["output"], job["settings"]["centers"]) == (str(tmp_path / "box"), str(tmp_path / "out"), 16)
    last = json.loads((tmp_path / "job" / "template.json").read_text())["steps"][-1]["script"]["actions"]["onRun"]
    words = ["{{Param.Input}}", "--output", "{{Param.Output}}", "--centers", "16", "--export", "usd", f"--preview={tmp_path / 'p.png'}"]
    assert (last["command"], last["args"]) == (sys.executable, [str(SCRIPT), *words])
    assert not (tmp_path / "out").exists()


def test_a_compressed_export_is_decoded_by_another_process(frames, tmp_path):
    pytest.importorskip("constriction")
    export = ["--export", "refmesh", "--export-refmesh-quality", "fine"]
    assert run("box", "--frames", "20-21", "--output", "out", *TINY, *export, cwd=tmp_path).returncode == 0
    done = run("decode", "out/export/box.refmesh", "--output", "decoded", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.split() == ["decoded/frame_0020.ply", "decoded/frame_0021.ply"]
    for name in ("frame_0020.ply", "frame_0021.ply"):
        before, after = (read_surface(tmp_path / folder / name) for folder in ("out/deformed", "decoded"))
        assert len(after.triangles) == len(before.triangles)
        np.testing.assert_allclose(np.ptp(after.vertices, axis=0), np.ptp(before.vertices, axis=0), atol=0.01)


def test_a_foreign_file_is_not_decoded(frames, tmp_path):
    done = run("decode", "box/box_20.obj", "--output", "decoded", cwd=tmp_path)
    assert done.returncode == 1 and "box_20.obj: is not a .refmesh file" in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["decode", "x.refmesh"], "--output"),
        ([], "--output"),
        (["box"], "--output"),
        (["box", "--output", "out", "--centers", "3"], "--centers"),
        (["box", "--output", "out", "--smoothness", "much"], "--smoothness"),
        (["box", "--output", "out", "--centers", "auto"], "--centers"),
        (["box", "--output", "out", "--group-size", "many"], "auto or a number"),
        (["box", "--output", "out", "--mesh-frame", "last"], "first or reference or a number"),
        (["box", "--output", "out", "--mapping", "magic"], "--mapping"),
        (["box", "--output", "out", "--export", "dae"], "--export"),
        (["box", "--output", "out", "--export-step", "0"], "'0' is not a number from 1 upward"),
        (["box", "--output", "out", "--preview", "picture.txt"], "'picture.txt' does not end in .png"),
        (["box", "--output", "out", "--no-such-option"], "--no-such-option"),
        (["box", "--output", "out", "--cent", "100"], "--cent"),
    ],
)
def test_wrong_options_are_named_in_one_line(frames, tmp_path, arguments, message):
    done = run(*arguments, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert message in done.stderr and len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "source, extra, message",
    [
        ("nothing", [], "nothing: no such file or folder"),
        ("box", ["--frames", "20-99"], "frame 99"),
        ("box/box_21.obj", ["--frames", "21-"], "--frames"),
        ("empty", [], "no meshes found"),
        ("box", ["--export", "ply", "--export-first", "99"], "no frames to export"),
        ("box", ["--export", "usd", "--export-step", "2"], "every frame of the range is written; leave out the step"),
    ],
)
def test_wrong_input_is_named_in_one_line(frames, tmp_path, source, extra, message):
    (tmp_path / "empty").mkdir()
    done = run(source, "--output", "out", *extra, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (1, "")
    assert message in done.stderr and len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_output_that_cannot_be_written_is_named(frames, tmp_path):
    (tmp_path / "file").write_text("in the way")
    done = run("box", "--output", "file/out", "--quiet", *TINY, cwd=tmp_path)
    assert done.returncode == 1 and "out" in done.stderr and len(done.stderr.splitlines()) == 1


def test_help_explains_every_setting_once():
    text = " ".join(run("--help").stdout.split())
    for setting in flat_fields():
        assert text.count(f" --{setting.name.replace('_', '-')} ") >= 1, setting.name
        assert setting.metadata["help"] in text
    assert all(name in text for name in PRESETS)


def test_missing_bpy_names_the_way_out(frames, tmp_path):
    arguments = ["run.py", "box", "--output", "out"]
    code = f"import sys, runpy; sys.modules['bpy'] = None; sys.argv = {arguments}; runpy.run_path({str(SCRIPT)!r}, run_name='__main__')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 1 and "make demo" in done.stderr and len(done.stderr.splitlines()) == 1


def test_arguments_after_two_dashes_are_ours(frames, tmp_path):
    done = run("--background", "--", "nothing", "--output", "out", cwd=tmp_path)
    assert done.returncode == 1 and "nothing" in done.stderr


def test_operators_alone_are_used():
    """The script reaches the add-on by operator ids, so that it serves an installed extension as well."""
    sources = "".join(path.read_text() for path in sorted(SCRIPT.parent.glob("*.py")))
    lines = [line.strip() for line in sources.splitlines() if "refmesh_addon" in line]
    assert lines == ["import refmesh_addon", "refmesh_addon.register()", "return refmesh_addon"]
    assert os.access(SCRIPT, os.R_OK) and bpy.app.version >= (4, 2)


def test_check_prints_what_is_wrong_and_runs_nothing(frames, tmp_path):
    sound = run(frames, "--output", tmp_path / "out", "--check")
    assert (sound.returncode, sound.stdout.splitlines()[-1]) == (0, "nothing found"), sound.stderr
    huge = run(frames, "--output", tmp_path / "huge", "--check", "--quiet", "--unit", "FACTOR", "--unit-factor", "1000")
    assert huge.returncode == 0 and "m long: if this is a person, scale by 0.001" in huge.stdout, huge.stdout
    (frames / "box_21.obj").write_text("this is no mesh")
    broken = run(frames, "--output", tmp_path / "out", "--check", "--quiet", "--frames", "20-22")
    assert broken.returncode == 1 and "frame 21: cannot be read as OBJ" in broken.stdout
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"cache", "sequence_check.json", "sequence_check.txt"}


@pytest.fixture(params=["abc", "usd"])
def cache(request, tmp_path) -> Path:
    """A file in which a ball moves and gets another skin with every frame, beside a box that stands still."""
    if not getattr(bpy.app.build_options, {"abc": "alembic", "usd": "usd"}[request.param]):
        pytest.skip("this Blender was built without it")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_cube_add(location=(9, 0, 0))
    bpy.context.active_object.name = bpy.context.active_object.data.name = "box"
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
    ball = bpy.context.active_object
    ball.name = ball.data.name = "ball"
    for level in (0, 1):
        skin = ball.modifiers.new(f"skin {level}", "SOLIDIFY")
        for frame in (1, 2, 3):
            skin.show_viewport = skin.show_render = frame > level + 1
            skin.keyframe_insert("show_viewport", frame=frame)
            skin.keyframe_insert("show_render", frame=frame)
    for frame in (1, 3):
        ball.location.x = 0.1 * frame
        ball.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 3
    path = tmp_path / f"scan.{request.param}"
    if request.param == "abc":
        bpy.ops.wm.alembic_export(filepath=str(path), as_background_job=False, evaluation_mode="VIEWPORT")
    else:
        bpy.ops.wm.usd_export(filepath=str(path), export_animation=True, evaluation_mode="VIEWPORT")
    return path


def test_an_animated_object_of_a_scene_file_is_a_sequence(cache, tmp_path):
    several = run(cache, "--output", tmp_path / "out", "--check")
    assert several.returncode == 1 and "has the mesh objects ball, box; name one of them with --object" in several.stderr
    finished = run(cache, "--object", "ball", "--output", tmp_path / "out", *TINY)
    assert finished.returncode == 0, finished.stderr
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert [frame["number"] for frame in report["frames"]] == [1, 2, 3]
    counts = [_vertices(tmp_path / "out" / "source" / f"ball_{number:04d}.ply") for number in (1, 2, 3)]
    assert counts[0] < counts[1] < counts[2]


def _vertices(path: Path) -> int:
    return next(int(line.split()[-1]) for line in path.read_bytes().splitlines() if line.startswith(b"element vertex"))
