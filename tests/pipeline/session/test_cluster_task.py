"""Tasks as they travel: by value, with the files that a worker does not see."""

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.pipeline.session.cluster_code import code_archive
from refmesh_addon.pipeline.session.cluster_task import DONE, FAILED, NO_FILES, Answer, InputFile, Task, execute
from refmesh_addon.pipeline.stages.color_survey import frame_colors

from ..colored_takes import write_textured


def total(values: np.ndarray, path: Path) -> float:
    return float(values.sum()) + len(path.read_bytes())


def refuse(path: Path) -> None:
    raise RefMeshError(f"{path}: cannot be used")


def answer(task: Task) -> Answer:
    return pickle.loads(execute(task.packed()))


def moved_away(task: Task) -> Task:
    """As on a machine that has another file of this name."""
    return replace(task, arguments=tuple(replace(item, time=0) if isinstance(item, InputFile) else item for item in task.arguments))


@pytest.fixture
def file(tmp_path) -> Path:
    path = tmp_path / "scan_1.obj"
    path.write_bytes(b"v 0 0 0\n")
    return path


def test_a_shared_file_is_read_in_place_and_another_is_sent(file):
    task = Task.of(total, (np.arange(3.0), file))
    assert answer(task) == Answer(DONE, 11.0)
    assert answer(moved_away(task)).outcome == NO_FILES
    assert answer(moved_away(task).with_files()) == Answer(DONE, 11.0)


def test_a_frame_is_sent_with_the_pictures_that_its_colors_come_from(tmp_path):
    frame = write_textured(tmp_path / "take") / "ball_004.obj"
    task = Task.of(frame_colors, (frame,))
    sent = moved_away(task).with_files()
    assert {name for name, data in sent.arguments[0].contents.items() if data} == {"ball_004.obj", "ball_004.mtl", "ball_004.png"}
    here, there = answer(task).value, answer(sent).value
    assert here.colored and here == there


def test_an_error_names_the_file_of_the_sender(file):
    for task in (Task.of(refuse, (file,)), moved_away(Task.of(refuse, (file,))).with_files()):
        refused = answer(task)
        assert (refused.outcome, str(refused.value)) == (FAILED, f"{file}: cannot be used")


def test_a_file_that_is_gone_is_named(file):
    task = Task.of(total, (np.arange(3.0), file))
    file.unlink()
    with pytest.raises(RefMeshError, match="scan_1.obj: cannot be read"):
        task.with_files()
    with pytest.raises(RefMeshError, match="scan_1.obj: cannot be read"):
        Task.of(total, (np.arange(3.0), file))


def test_a_worker_without_a_package_is_named_and_one_with_another_version_noted(file):
    task = Task.of(total, (np.arange(3.0), file))
    refused = answer(replace(task, packages={**task.packages, "xatlas_of_old": ""}))
    assert refused.outcome == FAILED and "the Python packages xatlas_of_old are missing there" in str(refused.value)
    noted = answer(replace(task, packages={**task.packages, "numpy": "0.1"}))
    assert noted.value == 11.0 and "in place of 0.1" in noted.note
    threads = answer(replace(task, packages={**task.packages, "OMP_NUM_THREADS": "77"}))
    assert "OMP_NUM_THREADS" in threads.note and "in place of 77" in threads.note


def test_code_is_the_same_each_time_and_holds_nothing_of_blender():
    (digest, archive), again = code_archive(), code_archive()
    assert again == (digest, archive)
    assert b"refmesh_addon/pipeline/session/xatlas_process.py" in archive and b"refmesh_addon/operators" not in archive
