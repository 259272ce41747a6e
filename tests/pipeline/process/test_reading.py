"""Files read in a process of their own: the same meshes, errors by name, and an end whatever a file does."""

import os
import sys

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.preview import PreviewMesh
from refmesh_addon.pipeline.process.reading import ReadingProcess
from tests.core.shapes import ball


@pytest.fixture(scope="module")
def process():
    process = ReadingProcess()
    yield process
    process.close()


@pytest.fixture
def frame(tmp_path):
    path, sphere = tmp_path / "größe 1.obj", ball(1)
    lines = [f"v {x} {y} {z}" for x, y, z in sphere.vertices] + [f"f {a} {b} {c}" for a, b, c in sphere.triangles + 1]
    path.write_text("\n".join([*lines, ""]))
    return path


def test_a_mesh_is_the_same_as_read_here(process, frame):
    expected = PreviewMesh.of(read_mesh(frame))
    for name, array in process.call("frame", str(frame)).items():
        assert_array_equal(array, getattr(expected, name))


def test_one_process_serves_many_files_and_another_one_follows_it(process, frame):
    process.call("frame", str(frame))
    first = process._process
    process.call("frame", str(frame))
    assert process._process is first
    first.stdin.close()  # as at the end of its idle time, it ends by itself
    first.wait()
    assert len(process.call("frame", str(frame))["triangles"]) == len(ball(1).triangles)


def test_damaged_and_missing_files_are_named(process, tmp_path):
    (tmp_path / "broken.obj").write_text("v 1 2\n")
    for name, reason in (("broken.obj", "line 1"), ("gone.obj", "cannot be read")):
        with pytest.raises(RefMeshError, match=f"{name}: .*{reason}"):
            process.call("frame", str(tmp_path / name))


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_a_file_that_ends_the_process_or_takes_too_long_is_named(frame, monkeypatch):
    for limit, program, message in (
        (60.0, "import sys, os; sys.stdin.readline(); os.abort()", "ends the process that reads it"),
        (1.0, "import time; time.sleep(60)", "takes longer than 1 seconds"),
    ):
        process = ReadingProcess(limit)
        monkeypatch.setattr("refmesh_addon.pipeline.process.reading.MODULE", _module(frame.parent, program))
        monkeypatch.setattr(
            "refmesh_addon.pipeline.process.reading.worker_environment", lambda: {**os.environ, "PYTHONPATH": str(frame.parent)}
        )
        with pytest.raises(RefMeshError, match=f"{frame.name}: cannot be read: it {message}"):
            process.call("frame", str(frame))
        process.close()


def test_a_stream_is_decoded_there(process, tmp_path):
    pytest.importorskip("constriction")
    from refmesh_addon.core.compression.group_encoder import Balance
    from refmesh_addon.io.refmesh_stream.reader import StreamReader
    from refmesh_addon.io.refmesh_stream.writer import Quality, write_stream
    from tests.io.refmesh_stream.bodies import torus_groups

    path = tmp_path / "torus.refmesh"
    write_stream(path, torus_groups(), 4.0, 25.0, Quality(step=4e-3, balance=Balance(nodes=8)))
    reader, entries = StreamReader(path), process.call("stream_entries", str(path))
    assert_array_equal(entries["numbers"], np.concatenate([entry.numbers for entry in reader.entries]))
    assert_array_equal(process.call("stream_group", str(path), 1)["positions"], reader.group(1).positions)
    written = process.call("decode", str(path), str(tmp_path / "frames"))["written"]
    assert len(written) == entries["counts"].sum() and all(os.path.isfile(name) for name in written)


def _module(folder, program):
    (folder / "stand_in.py").write_text(program)
    return "stand_in"
