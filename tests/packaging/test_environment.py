"""environment/create.py, run on a copy of its own."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def create(folder: Path) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, str(folder / "environment" / "create.py")], capture_output=True, text=True)


def copy_with_empty_lock(folder: Path) -> Path:
    (folder / "environment").mkdir()
    shutil.copy(ROOT / "environment" / "create.py", folder / "environment")
    (folder / "environment" / "requirements.txt").write_text("# nothing, so the trial import of bpy fails\n")
    return folder


def test_unfinished_environment_is_made_again(tmp_path):
    folder = copy_with_empty_lock(tmp_path)
    left_over = folder / ".venv" / "left-over"
    left_over.parent.mkdir()
    left_over.touch()
    result = create(folder)
    assert result.returncode == 1
    assert "import bpy" in result.stderr.splitlines()[-1]
    assert not left_over.exists()
    assert not (folder / ".venv" / "made-from").exists()


def test_finished_environment_is_kept_and_stale_one_is_not(tmp_path):
    folder = copy_with_empty_lock(tmp_path)
    script = folder / "environment" / "create.py"
    script.write_text(re.sub(r"^TRIALS = .*$", "TRIALS = ()", script.read_text(), flags=re.MULTILINE))
    assert create(folder).returncode == 0
    made = (folder / ".venv" / "made-from").stat().st_mtime_ns
    assert create(folder).stdout == ""
    assert (folder / ".venv" / "made-from").stat().st_mtime_ns == made
    (folder / "environment" / "requirements.txt").write_text("# another lock\n")
    assert "making" in create(folder).stdout
