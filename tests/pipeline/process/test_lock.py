import os
import signal
import subprocess
import sys

import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.pipeline.process import lock
from refmesh_addon.pipeline.process.environment import worker_environment
from refmesh_addon.pipeline.process.lock import SCRIPT_LOCK_NAME, job_lock, keep_lock, output_lock

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
    with pytest.raises(RefMeshError, match="not a regular file"), output_lock(tmp_path, "OUT"):
        pass


TAKER = """
import sys
from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.pipeline.process.lock import job_lock
try:
    with job_lock(sys.argv[1], "OUT"):
        print("held")
except RefMeshError as error:
    print(error)
"""


def taken(command, folder) -> str:
    return subprocess.run([*command, str(folder)], capture_output=True, text=True, env=worker_environment(), check=True).stdout


def test_a_script_keeps_the_folder_after_its_job_and_only_its_own_worker_gets_in(tmp_path):
    keep_lock(tmp_path / "cache", "OUT")
    child = [sys.executable, "-c", TAKER]
    assert taken(child, tmp_path / "cache") == "held\n"
    grandchild = [sys.executable, "-c", f"import subprocess, sys; subprocess.run([sys.executable, '-c', {TAKER!r}, sys.argv[1]])"]
    assert f"another RefMesh job (process {os.getpid()}) is writing here" in taken(grandchild, tmp_path / "cache")
    keep_lock(tmp_path / "other", "OTHER")
    assert taken(grandchild, tmp_path / "cache") == "held\n"


def test_a_script_waits_for_the_job_of_a_window(tmp_path):
    with job_lock(tmp_path, "OUT"), pytest.raises(RefMeshError, match="another RefMesh job"):
        keep_lock(tmp_path, "OUT")
    keep_lock(tmp_path, "OUT")
    with pytest.raises(RefMeshError, match="another RefMesh job"), output_lock(tmp_path, "OUT", SCRIPT_LOCK_NAME):
        pass
    keep_lock(tmp_path / "other", "OTHER")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full here to stand for a full disk")
def test_a_full_disk_is_told_by_name(tmp_path, monkeypatch):
    monkeypatch.setattr(lock, "_open_no_link", lambda path, flags: os.open("/dev/full", os.O_RDWR))
    with pytest.raises(RefMeshError, match=r"lock: cannot be written"):
        (tmp_path / "lock").touch()
        with output_lock(tmp_path, "OUT"):
            pass
