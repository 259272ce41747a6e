"""A job for a render farm, run by the reference implementation of Open Job Description."""

import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.settings import Settings
from refmesh_addon.pipeline.process.environment import worker_environment
from refmesh_addon.pipeline.process.lock import job_lock, shared_lock
from refmesh_addon.pipeline.process.open_job import MODULE, SceneCommand, write_open_job
from refmesh_addon.pipeline.session.job import JobSpec
from refmesh_addon.pipeline.stages.steps import job_steps

from ..conftest import FRAMES, TINY
from ..running import results


def openjd(*arguments) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, "-m", "openjd", *map(str, arguments)], capture_output=True, text=True)


def long_job(source, output) -> JobSpec:
    """With one mesh for all frames, which needs a review, and without what other tests cover."""
    return JobSpec(str(source), str(output), settings=Settings.from_flat({**TINY.to_flat(), "segments": "long"}))


def test_a_template_is_valid_and_has_the_steps_of_the_job(two_balls, tmp_path):
    pytest.importorskip("openjd.model")
    spec = long_job(two_balls, tmp_path / "out")
    scene = SceneCommand(["python", "{{odd}}"], ["--export=usd"])
    files = write_open_job(tmp_path / "job", spec, "two {{balls}}", len(FRAMES), scene)
    template, values = json.loads(files[0].read_text()), json.loads(files[2].read_text())
    assert [step["name"] for step in template["steps"]] == [*(step.title for step in job_steps(spec, len(FRAMES))), "Write Scene"]
    assert values["Tasks"] == len(FRAMES) and set(values) == {item["name"] for item in template["parameterDefinitions"]}
    checked = openjd("check", files[0])
    assert checked.returncode == 0, checked.stdout + checked.stderr
    summary = openjd("summary", files[0], "-p", f"file://{files[2]}")
    assert summary.returncode == 0 and "Write Scene" in summary.stdout, summary.stdout + summary.stderr


@pytest.mark.parametrize(
    "changes, names",
    [
        ({"segments": "long"}, "read track place align build review deform smooth measure survey layout bake steady textures results"),
        ({"texture": "off"}, "read track place align build deform smooth measure results"),
    ],
)
def test_steps_depend_on_what_is_to_be_done(changes, names):
    spec = JobSpec("in", "out", settings=Settings.from_flat({**TINY.to_flat(), **changes}))
    assert [step.name for step in job_steps(spec, 60)] == names.split()
    early = job_steps(replace(spec, until="reference"), 60)
    assert [step.name for step in early] == "read track place align build results".split()


def test_openjd_runs_the_job_to_the_same_bytes(two_balls, tmp_path):
    """As one process writes that has one thread as well: sums depend on how many there are."""
    pytest.importorskip("openjd.cli")
    spec = JobSpec(str(two_balls), str(tmp_path / "out"), settings=Settings.from_flat({**TINY.to_flat(), "texture": "off"}))
    files = write_open_job(tmp_path / "job", spec, "two balls", len(FRAMES))
    values = {**json.loads(files[2].read_text()), "Tasks": 2}
    files[2].write_text(json.dumps(values))
    alone = part(replace(spec, output=str(tmp_path / "alone")), tmp_path / "job", "results")
    assert alone.returncode == 0, alone.stderr
    done = openjd("run", files[0], "-p", f"file://{files[2]}", "--step", "Write Results", "--run-dependencies")
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr
    assert results(tmp_path / "out") == results(tmp_path / "alone")


def part(spec: JobSpec, folder: Path, *arguments: str) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", MODULE, str(folder / "job.json"), spec.source, spec.output, *arguments]
    return subprocess.run(command, env=worker_environment(), capture_output=True, text=True)


def test_parts_of_a_step_run_together_and_after_the_one_before(two_balls, tmp_path):
    spec = JobSpec(str(two_balls), str(tmp_path / "out"), settings=TINY)
    write_open_job(tmp_path / "job", spec, "two balls", len(FRAMES))
    early = part(spec, tmp_path / "job", "align", "1", "2")
    assert early.returncode == 1 and "an earlier step of the job is not complete" in early.stderr
    with ThreadPoolExecutor(2) as pool:
        both = list(pool.map(lambda number: part(spec, tmp_path / "job", "read", number, "2"), ("1", "2")))
    assert [one.returncode for one in both] == [0, 0], both
    assert len(list((tmp_path / "out" / "cache" / "frames").glob("*.npz"))) == len(FRAMES)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"cache"}
    unknown = part(spec, tmp_path / "job", "paint")
    assert unknown.returncode == 1 and "openjd_fail: " in unknown.stdout and "no step 'paint'" in unknown.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no locks that several processes hold")
def test_parts_share_a_folder_with_each_other_but_not_with_a_whole_run(tmp_path):
    with shared_lock(tmp_path, "out"), shared_lock(tmp_path, "out"):
        with pytest.raises(RefMeshError, match="another RefMesh job"), job_lock(tmp_path, "out"):
            pass
    with job_lock(tmp_path, "out"), pytest.raises(RefMeshError, match="another RefMesh job"), shared_lock(tmp_path, "out"):
        pass
