"""A Dask cluster on this machine, as people start it: a scheduler and workers, each a process that knows nothing of RefMesh."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

pytest.importorskip("distributed")

from refmesh_addon.core.errors import Canceled, RefMeshError  # noqa: E402
from refmesh_addon.pipeline.run import run  # noqa: E402
from refmesh_addon.pipeline.session.cluster_workers import ClusterWorkers  # noqa: E402
from refmesh_addon.pipeline.session.job import JobSpec  # noqa: E402

from ..conftest import TINY  # noqa: E402
from ..running import cache_entries, remade, results  # noqa: E402

PATIENCE = 60.0  # seconds until a test gives up
WORKERS = 4


class Cluster:
    """A scheduler and its workers."""

    def __init__(self, folder: Path, stack: ExitStack):
        self._folder, self._stack = folder, stack
        self.scheduler = self._start("scheduler", "--port", "0")
        self.workers = [self.add_worker() for _ in range(WORKERS)]

    @property
    def address(self) -> str:
        """Of the scheduler, once it runs."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            try:
                return json.loads((self._folder / "scheduler.json").read_text())["address"]
            except (OSError, ValueError):
                time.sleep(0.05)
        raise TimeoutError

    def add_worker(self) -> subprocess.Popen:
        """One process, without the nanny that would start it again when it dies."""
        return self._start("worker", "--nthreads", "2", "--no-nanny", "--local-directory", str(self._folder), "--death-timeout", "60")

    def _start(self, kind: str, *arguments: str) -> subprocess.Popen:
        # As many threads as the processes that made what results are compared with: sums depend on them.
        environment = {name: text for name, text in os.environ.items() if name != "PYTHONPATH"}
        arguments = (*arguments, "--host", "127.0.0.1", "--no-dashboard", "--scheduler-file", "scheduler.json")
        process = subprocess.Popen(
            [sys.executable, "-m", "dask", kind, *arguments],
            cwd=self._folder,
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self._stack.callback(process.wait)
        self._stack.callback(process.kill)
        return process


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    with ExitStack() as stack:
        yield Cluster(tmp_path_factory.mktemp("cluster"), stack)


def job(source, output, cluster) -> JobSpec:
    return JobSpec(str(source), str(output), settings=TINY, scheduler=cluster.address)


def test_errors_of_tasks_and_a_canceled_job_reach_the_caller(cluster, two_balls, tmp_path):
    (tmp_path / "take").mkdir()
    (tmp_path / "take" / "scan_1.obj").write_text("this is no mesh")
    with pytest.raises(RefMeshError, match="scan_1.obj: cannot be read as OBJ"):
        run(job(tmp_path / "take", tmp_path / "out", cluster), lambda *_: None, lambda message: None)

    def notify(stage, frame, share, skipped=False):
        raise Canceled

    with pytest.raises(Canceled):
        run(job(two_balls, tmp_path / "canceled", cluster), notify, lambda message: None)


def test_a_cluster_gives_the_same_bytes_though_a_worker_is_killed(cluster, two_balls, finished, tmp_path):
    """The worker dies in the middle of the deformation."""
    warnings = []

    def notify(stage, frame, share, skipped=False):
        if stage == "deformation" and len(cluster.workers) == WORKERS:
            cluster.workers.pop().send_signal(signal.SIGKILL)

    run(job(two_balls, tmp_path / "out", cluster), notify, warnings.append)
    assert len(cluster.workers) == WORKERS - 1 and not warnings
    assert results(tmp_path / "out") == results(finished)


def test_a_lost_scheduler_leaves_what_is_done_and_the_job_continues(cluster, two_balls, finished, tmp_path):
    """After the other tests, as the cluster ends with its scheduler."""
    out = tmp_path / "out"

    def notify(stage, frame, share, skipped=False):
        if stage == "reference" and share > 0.3:
            cluster.scheduler.send_signal(signal.SIGKILL)

    with pytest.raises(RefMeshError, match="connection is lost; what is done is kept, start the job again"):
        run(job(two_balls, out, cluster), notify, lambda message: None)
    before = cache_entries(out)
    assert any(name.startswith("reference/") for name in before)
    run(JobSpec(str(two_balls), str(out), settings=TINY), lambda *_: None, lambda message: None)
    assert results(out) == results(finished)
    assert not remade(before, cache_entries(out)) & set(before), "nothing that was done is computed again"


def test_a_scheduler_that_does_not_answer_is_named(monkeypatch):
    monkeypatch.setattr("refmesh_addon.pipeline.session.cluster_workers.CONNECT_TIMEOUT", 0.5)
    for address in ("tcp://127.0.0.1:1", "no address"):
        with pytest.raises(RefMeshError, match=f"--scheduler {address}: no Dask scheduler answers there"), ClusterWorkers(address):
            pass
