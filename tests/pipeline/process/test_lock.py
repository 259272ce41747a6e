import os
import signal
import subprocess
import sys

import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.pipeline.process.environment import worker_environment
from refmesh_addon.pipeline.process.lock import output_lock

HOLDER = """
import sys
from refmesh_addon.pipeline.process.lock import output_lock
with output_lock(sys.argv[1], "OUT"):
    print("held", flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def holder(tmp_path):
    command = [sys.executable, "-c", HOLDER, str(tmp_path)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=worker_environment())
    assert process.stdout.readline().strip() == b"held"
    yield process
    process.kill()
    process.communicate()


def test_a_second_job_is_refused_and_told_who_is_first(tmp_path, holder):
    with (
        pytest.raises(RefMeshError, match=rf"OUT: another RefMesh job \(process {holder.pid}\) is writing here"),
        output_lock(tmp_path, "OUT"),
    ):
        pass
    holder.communicate()
    with output_lock(tmp_path, "OUT"):
        assert (tmp_path / "lock").read_text() == str(os.getpid())


def test_the_lock_of_a_killed_process_is_taken_over(tmp_path, holder):
    holder.send_signal(signal.SIGKILL if os.name == "posix" else signal.SIGTERM)
    holder.wait()
    assert (tmp_path / "lock").read_text() == str(holder.pid)
    with output_lock(tmp_path, "OUT"):
        pass


def test_the_lock_is_free_after_an_error(tmp_path):
    with pytest.raises(ZeroDivisionError), output_lock(tmp_path, "OUT"):
        1 / 0  # noqa: B018
    with output_lock(tmp_path, "OUT"):
        pass


def test_other_folders_are_not_locked(tmp_path):
    with output_lock(tmp_path / "a", "A"), output_lock(tmp_path / "b", "B"):
        pass


@pytest.mark.skipif(os.name != "posix", reason="links need rights of their own on Windows")
@pytest.mark.parametrize("link", [os.symlink, os.link])
def test_a_file_that_is_linked_to_the_lock_is_not_emptied(tmp_path, link):
    (tmp_path / "thesis").write_text("years of work")
    (tmp_path / "cache").mkdir()
    link(tmp_path / "thesis", tmp_path / "cache" / "lock")
    with pytest.raises(RefMeshError, match="cache/lock: "), output_lock(tmp_path / "cache", "OUT"):
        pass
    assert (tmp_path / "thesis").read_text() == "years of work"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes here")
def test_a_named_pipe_in_place_of_the_lock_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "lock")
    with pytest.raises(RefMeshError, match="no regular file"), output_lock(tmp_path, "OUT"):
        pass
