"""The worker from outside: what it writes and how it ends."""

import os
import subprocess
from dataclasses import replace

import pytest

from refmesh_addon.core.errors import Canceled
from refmesh_addon.pipeline.process.environment import python_executable, worker_environment
from refmesh_addon.pipeline.process.events import Event
from refmesh_addon.pipeline.process.forecast import Forecast, StageTime
from refmesh_addon.pipeline.process.worker import Reporter
from refmesh_addon.pipeline.session.job import CHECK, STAGE_WEIGHTS, STAGES, JobSpec

from ..conftest import TINY


def run_worker(job_file, python_path=(), stdin=None):
    """Exit code, events and stderr of one worker; its stdin is held open unless given."""
    environment = worker_environment()
    environment["PYTHONPATH"] = os.pathsep.join([*map(str, python_path), environment["PYTHONPATH"]])
    command = [python_executable(), "-m", "refmesh_addon.pipeline.process.worker", str(job_file)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment, text=True
    ) as process:
        if stdin is not None:
            process.stdin.write(stdin)
            process.stdin.close()
        lines, errors = process.stdout.read().splitlines(), process.stderr.read()
    events = [Event.from_line(line) for line in lines]
    assert None not in events, f"stdout holds something else than events: {lines}"
    return process.returncode, events, errors


@pytest.fixture
def job_file(tmp_path, two_balls):
    def write(source=two_balls, **changes):
        path = tmp_path / "job.json"
        path.write_text(JobSpec(str(source), str(tmp_path / "out"), settings=TINY, **changes).to_json())
        return path

    return write


def forecast(stages) -> Forecast:
    return Forecast({stage: StageTime(STAGE_WEIGHTS[stage]) for stage in stages})


def test_shares_grow_over_the_stages_wanted_and_end_at_one():
    for wanted in (STAGES, STAGES[:2], STAGES[:1]):
        sent = []
        reporter = Reporter(forecast(wanted), sent.append)
        for stage in wanted:
            for share in (0.0, 0.5, 0.2, 1.0):
                reporter._last_sent = float("-inf")  # nothing is held back for coming too soon
                reporter.progress(stage, None, share)
        shares = [event.share for event in sent]
        assert shares == sorted(shares)
        assert shares[0] == 0.0 and shares[-1] > 0.95


def test_every_stage_has_a_weight():
    assert set(STAGE_WEIGHTS) == {CHECK, *STAGES}


def test_a_flood_of_progress_is_thinned_but_no_stage_is_lost():
    sent = []
    reporter = Reporter(forecast(STAGES), sent.append)
    for stage in STAGES:
        for step in range(2000):
            reporter.progress(stage, step, step / 2000)
    assert list(dict.fromkeys(event.stage for event in sent)) == list(STAGES)
    assert len(sent) < 2000


def test_a_wish_to_stop_is_raised_at_the_next_step():
    reporter = Reporter(forecast(STAGES), lambda event: None)
    reporter.progress("tracking", None, 0.1)
    reporter.cancel.set()
    with pytest.raises(Canceled):
        reporter.progress("tracking", None, 0.2)


@pytest.mark.parametrize("stdin", ["cancel\n", ""])
def test_a_worker_stops_when_told_and_when_its_parent_is_gone(job_file, stdin):
    code, events, _ = run_worker(job_file(), stdin=stdin)
    assert events[-1].kind == "canceled"
    assert code == 1


def test_a_job_that_ends_with_the_deformation_tells_progress_while_it_reviews_its_meshes(job_file, tmp_path):
    path = job_file(until="deformation")
    spec = JobSpec.from_json(path.read_text())
    long = replace(spec.settings.reference, segments="long")
    path.write_text(replace(spec, settings=replace(spec.settings, reference=long)).to_json())
    code, events, errors = run_worker(path)
    assert (code, events[-1].kind) == (0, "done"), (events[-1], errors)
    assert "evaluation" in {event.stage for event in events}
    assert (tmp_path / "out" / "deformed").is_dir()


def test_a_wrong_input_is_one_line_and_makes_no_folder(job_file, tmp_path):
    code, events, errors = run_worker(job_file(source=tmp_path / "nowhere"))
    assert (code, [event.kind for event in events]) == (1, ["failed"])
    assert events[0].message.startswith(f"{tmp_path / 'nowhere'}: no such file or folder")
    assert "Traceback" not in errors
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("content", [None, "{", '{"source": "a"}'])
def test_a_job_file_that_cannot_be_used_is_told(tmp_path, content):
    path = tmp_path / "job.json"
    if content is not None:
        path.write_text(content)
    _, events, _ = run_worker(path)
    assert "job file" in events[-1].message


def test_a_missing_package_is_named_with_what_to_do(job_file, tmp_path):
    broken = tmp_path / "broken" / "scipy"
    broken.mkdir(parents=True)
    (broken / "__init__.py").write_text("raise ModuleNotFoundError(\"No module named 'scipy'\", name='scipy')")
    _, events, _ = run_worker(job_file(), python_path=[broken.parent])
    assert events[-1].kind == "failed"
    assert events[-1].message.startswith("the Python package 'scipy' is missing: install")


def test_a_package_that_cannot_load_is_told_with_its_reason(job_file, tmp_path):
    broken = tmp_path / "broken" / "scipy"
    broken.mkdir(parents=True)
    (broken / "__init__.py").write_text("raise ImportError('libOpenGL.so.0: cannot open shared object file')")
    _, events, _ = run_worker(job_file(), python_path=[broken.parent])
    assert "libOpenGL.so.0: cannot open shared object file" in events[-1].message
    assert "worker.log" in events[-1].message


def test_a_fault_of_ours_is_one_line_with_the_traceback_in_the_log(job_file, tmp_path):
    broken = tmp_path / "broken" / "scipy"
    broken.mkdir(parents=True)
    (broken / "__init__.py").write_text("print('noise on stdout')\n{}['two\\nlines']")
    code, events, errors = run_worker(job_file(), python_path=[broken.parent])
    assert code == 1
    assert events[-1].message.startswith("internal error in start: KeyError:")
    assert "\n" not in events[-1].message
    assert "noise on stdout" in errors
    assert "Traceback" in (tmp_path / "out" / "cache" / "worker.log").read_text()
