"""Workers as Blender meets them: they finish, stop when asked, die, and outlive nobody."""

import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.pipeline.process.client import LOW_PRIORITY, WorkerProcess
from refmesh_addon.pipeline.process.environment import worker_environment
from refmesh_addon.pipeline.process.lock import output_lock
from refmesh_addon.pipeline.session.job import JobSpec

from ..conftest import FRAMES, TINY

ABANDON = """
import os, sys
from pathlib import Path
from refmesh_addon.pipeline.process.client import WorkerProcess
from refmesh_addon.pipeline.session.job import JobSpec
worker = WorkerProcess(JobSpec.from_json(Path(sys.argv[1]).read_text()))
next(event for event in worker.events() if event.kind == "progress")
os._exit(0)
"""
PATIENCE = 30.0  # seconds until a test gives up; none of them measures time


def job(source, output, **changes):
    return JobSpec(str(source), str(output), settings=TINY, **changes)


def wait_for(worker, stage):
    return next(event for event in worker.events() if event.stage == stage)


def results(output):
    """Name -> bytes of all that a run makes for others; the report holds times."""
    files = [path for path in Path(output).rglob("*") if path.is_file() and "cache" not in path.relative_to(output).parts]
    return {str(path.relative_to(output)): path.read_bytes() for path in files if path.name != "report.json"}


def temporary_jobs(folder):
    return list(Path(folder).glob("refmesh-*.json"))


@pytest.fixture(autouse=True)
def own_temporary_folder(tmp_path, monkeypatch):
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    return tmp_path / "temporary"


@pytest.fixture(scope="module")
def whole(two_balls, tmp_path_factory):
    """Output folder and events of a run that nobody disturbed."""
    output = tmp_path_factory.mktemp("whole")
    return output, list(WorkerProcess(job(two_balls, output)).events())


def test_a_job_ends_done_with_everything_written(whole):
    output, events = whole
    assert [event.kind for event in events if event.is_final] == ["done"], events[-1]
    assert events[-1].is_final
    shares = [event.share for event in events if event.kind == "progress"]
    assert shares == sorted(shares)
    assert {"report.json", "centers.npz", "reference", "deformed", "playback"} <= {path.name for path in output.iterdir()}
    assert {path.name for path in (output / "deformed").iterdir()} == {f"frame_{number:04d}.ply" for number in FRAMES}
    assert not list(output.rglob("*.refmesh-partial"))


def test_polling_never_blocks_and_gives_every_event_once(two_balls, tmp_path, own_temporary_folder):
    worker, polls, events = WorkerProcess(job(two_balls, tmp_path / "out", until="tracking")), 0, []
    while worker.running:
        events += worker.poll()
        polls += 1
        time.sleep(0.01)
    assert polls > 2
    assert events[-1].kind == "done"
    worker.cancel()
    assert worker.poll() == [], "after the end nothing comes, whatever is asked"
    assert not temporary_jobs(own_temporary_folder)


@pytest.mark.parametrize(("end", "stage"), [("cancel", "tracking"), ("kill", "reference"), ("kill", "deformation")])
def test_a_run_that_was_stopped_goes_on_to_the_same_bytes(two_balls, tmp_path, whole, end, stage, own_temporary_folder):
    output = tmp_path / "out"
    worker = WorkerProcess(job(two_balls, output))
    wait_for(worker, stage)
    if end == "cancel":
        worker.cancel()
    else:
        os.kill(worker.pid, signal.SIGTERM if os.name == "nt" else signal.SIGKILL)
    final = list(worker.events())[-1]
    assert final.kind == {"cancel": "canceled", "kill": "failed"}[end]
    assert end == "cancel" or "ended unexpectedly" in final.message
    assert not temporary_jobs(own_temporary_folder)
    assert list(WorkerProcess(job(two_balls, output)).events())[-1].kind == "done"
    assert results(output) == results(whole[0])


def test_a_run_that_is_done_is_done_again_without_work_and_without_resume_with_it(two_balls, whole):
    output, _ = whole
    before = results(output)
    assert list(WorkerProcess(job(two_balls, output)).events())[-1].kind == "done"
    assert results(output) == before
    assert list(WorkerProcess(job(two_balls, output, resume=False)).events())[-1].kind == "done"
    assert results(output) == before


def test_a_worker_does_not_outlive_its_parent(two_balls, tmp_path):
    output, job_file = tmp_path / "out", tmp_path / "job.json"
    job_file.write_text(job(two_balls, output).to_json())
    subprocess.run([sys.executable, "-c", ABANDON, str(job_file)], env=worker_environment(), check=True)
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        try:
            with output_lock(output / "cache", output):
                break
        except RefMeshError:
            time.sleep(0.1)
    else:
        pytest.fail("the worker still holds its lock")
    assert not (output / "deformed" / f"frame_{FRAMES[-1]:04d}.ply").exists(), "it did not finish, it stopped"


def test_a_second_job_in_the_same_folder_is_refused(two_balls, tmp_path):
    first = WorkerProcess(job(two_balls, tmp_path / "out"))
    wait_for(first, "tracking")
    second = list(WorkerProcess(job(two_balls, tmp_path / "out")).events())
    first.cancel()
    assert list(first.events())[-1].kind == "canceled"
    assert [event.kind for event in second] == ["failed"]
    assert f"another RefMesh job (process {first.pid}) is writing here" in second[0].message


def test_an_output_that_cannot_be_written_is_refused_by_name(two_balls, tmp_path):
    (tmp_path / "file").touch()
    final = list(WorkerProcess(job(two_balls, tmp_path / "file")).events())[-1]
    assert final.kind == "failed"
    assert str(tmp_path / "file") in final.message
    assert "cannot be written" in final.message


BAD_FRAMES = {
    "empty": b"",
    "text": b"this is not a mesh\n",
    "cut off": b"v 0 0 0\nv 1 0 0\nv 0 1",
    "not a number": b"v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n",
    "out of range": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 7\n",
}
PLANE = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"


@pytest.mark.parametrize("content", BAD_FRAMES.values(), ids=BAD_FRAMES.keys())
def test_a_bad_frame_is_named_and_nothing_is_half_written(two_balls, tmp_path, content):
    source, output = tmp_path / "in", tmp_path / "out"
    source.mkdir()
    for path in two_balls.iterdir():
        (source / path.name).write_bytes(path.read_bytes())
    (source / "balls_004.obj").write_bytes(content)
    final = list(WorkerProcess(job(source, output)).events())[-1]
    assert final.kind == "failed"
    assert "balls_004.obj" in final.message
    assert "internal error" not in final.message
    assert "\n" not in final.message
    assert not list(output.rglob("*.refmesh-partial"))


def test_a_frame_without_volume_is_bridged_and_named_or_refused_where_frames_are_fitted_as_captured(two_balls, tmp_path):
    source = tmp_path / "in"
    shutil.copytree(two_balls, source)
    (source / "balls_004.obj").write_bytes(PLANE)
    events = list(WorkerProcess(job(source, tmp_path / "bridged")).events())
    assert events[-1].kind == "done"
    assert any("frame 4" in event.message for event in events if event.kind == "warning")
    spec = job(source, tmp_path / "fitted")
    settings = replace(spec.settings, tracking=replace(spec.settings.tracking, bad_frames="fit"))
    final = list(WorkerProcess(replace(spec, settings=settings)).events())[-1]
    assert final.kind == "failed"
    assert "balls_004.obj" in final.message


@pytest.mark.skipif(os.name == "nt", reason="priorities are other things there")
@pytest.mark.parametrize("low_priority", [False, True])
def test_a_worker_of_low_priority_lets_others_go_first(two_balls, tmp_path, low_priority):
    worker = WorkerProcess(job(two_balls, tmp_path / "out"), low_priority)
    own = os.getpriority(os.PRIO_PROCESS, 0)
    assert os.getpriority(os.PRIO_PROCESS, worker.pid) == (max(own, LOW_PRIORITY) if low_priority else own)
    worker.cancel()
    list(worker.events())
