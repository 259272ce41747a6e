import builtins
import hashlib
import subprocess
import sys
from pathlib import Path
from platform import machine

import numpy as np
import pytest

from refmesh_addon.core.compression.group_encoder import Balance
from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.refmesh_stream.estimate import estimated
from refmesh_addon.io.refmesh_stream.reader import StreamReader
from refmesh_addon.io.refmesh_stream.writer import FrameGroup, Quality, write_stream
from tests.core import shapes
from tests.io.refmesh_stream.bodies import torus_groups, waving

pytest.importorskip("constriction")
QUALITY = Quality(step=1e-3, balance=Balance(nodes=20))
DIAGONAL = 4.0
# NumPy and OpenBLAS as they work on a processor without wide vectors and fused multiplications.
OTHER_PROCESSOR = {"NPY_DISABLE_CPU_FEATURES": "AVX2,FMA3", "OPENBLAS_CORETYPE": "Prescott"} if machine() in ("x86_64", "AMD64") else {}
VECTOR = Path(__file__).parent / "torus.refmesh"
VECTOR_POSITIONS = "276e3b8dc886ad6d2d1f114dbd2b4e4fdec4397bbc71c18b8596068ff1b5d06f"

STORED = (
    ("one_open_frame.refmesh", "302260b568e9e7a1a1bff190bfcbb31c56bba54e45d91ba6080564af3797017e"),
    ("still_bodies.refmesh", "fc850896800dc2d63b1d184fbdf80d16ffc86dd66a1c904dac46bfb66e5eb146"),
    ("torn_apart.refmesh", "c69763129374ace40ed3a2e909106a8e2eeca29d645a69838d737b6399bbf535"),  # numbers that need escapes
)


def written(path, groups, quality=QUALITY, diagonal=DIAGONAL):
    write_stream(path, groups, diagonal, 25.0, quality)
    return StreamReader(path)


@pytest.fixture(scope="module")
def reader(tmp_path_factory):
    return written(tmp_path_factory.mktemp("stream") / "torus.refmesh", torus_groups())


def test_frames_come_back_close_to_where_they_were(reader):
    assert reader.frame_rate == 25.0
    for index, group in enumerate(torus_groups()):
        decoded = reader.group(index)
        assert decoded.numbers == group.numbers and decoded.positions.shape == group.positions.shape
        for before, after in zip(group.positions, decoded.positions):
            distances = SurfaceIndex(TriangleMesh(before, group.triangles)).query(after).distances
            assert distances.max() < 5 * QUALITY.step * DIAGONAL


def test_a_group_is_decoded_without_those_before_it(reader, tmp_path):
    data = bytearray(reader.path.read_bytes())
    first = reader.entries[0]
    data[first.offset : first.offset + first.size] = bytes(first.size)
    (tmp_path / "half.refmesh").write_bytes(data)
    half = StreamReader(tmp_path / "half.refmesh")
    np.testing.assert_array_equal(half.group(1).positions, reader.group(1).positions)
    with pytest.raises(RefMeshError, match=r"half.refmesh: frames 4 to 6 are damaged \(its checksum is wrong\)"):
        half.group(0)


def test_the_same_frames_give_the_same_bytes(reader, tmp_path):
    again = written(tmp_path / "again.refmesh", torus_groups())
    assert again.path.read_bytes() == reader.path.read_bytes()


def test_scale_and_place_do_not_count(tmp_path):
    group = torus_groups()[0]
    near = written(tmp_path / "near.refmesh", [group]).group(0)
    far = FrameGroup(group.numbers, 1024.0 * group.positions + 2.0**20, group.triangles)
    moved = written(tmp_path / "far.refmesh", [far], diagonal=1024.0 * DIAGONAL).group(0)
    np.testing.assert_array_equal(moved.triangles, near.triangles)
    np.testing.assert_allclose((moved.positions - 2.0**20) / 1024.0, near.positions, atol=2e-3 * QUALITY.step * DIAGONAL * 64)


def test_stored_file_decodes_to_stored_positions():
    """On every platform, and with every version of NumPy and SciPy, bit by bit."""
    assert digest(StreamReader(VECTOR)) == VECTOR_POSITIONS


def test_byte_order_and_layout_of_what_is_given_do_not_count(tmp_path):
    """As arrays of another platform, or of another program, have them."""
    for index, group in enumerate(torus_groups()):
        foreign = FrameGroup(group.numbers, np.asfortranarray(group.positions.astype(">f8")), group.triangles.astype(">i4"))
        paths = [written(tmp_path / f"{name}_{index}.refmesh", [each]).path for name, each in (("native", group), ("foreign", foreign))]
        assert paths[0].read_bytes() == paths[1].read_bytes()


@pytest.mark.parametrize("name, digest_of_positions", STORED)
def test_stored_files_of_unusual_groups_decode_to_stored_positions(name, digest_of_positions):
    assert digest(StreamReader(VECTOR.with_name(name))) == digest_of_positions


@pytest.mark.parametrize("settings", [{"OMP_NUM_THREADS": "1", "PYTHONHASHSEED": "1"}, {"OMP_NUM_THREADS": "4", **OTHER_PROCESSOR}])
def test_another_process_decodes_the_same(settings):
    code = "from tests.io.refmesh_stream.test_stream import *; print(digest(StreamReader(VECTOR)))"
    root = Path(__file__).resolve().parents[3]
    environment = {"PYTHONPATH": str(root), **settings}
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=root, env=environment, check=True)
    assert result.stdout.strip() == VECTOR_POSITIONS


def digest(reader):
    """Of all positions and triangles, in little-endian order."""
    state = hashlib.sha256()
    for index in range(len(reader.entries)):
        group = reader.group(index)
        state.update(group.positions.astype("<f8").tobytes() + group.triangles.astype("<i8").tobytes())
    return state.hexdigest()


def test_long_groups_are_cut_and_a_reduced_one_has_fewer_triangles(tmp_path):
    mesh = shapes.ball(2)
    group = FrameGroup(tuple(range(100)), np.repeat(waving(mesh, 2), 50, axis=0), mesh.triangles)
    reader = written(tmp_path / "long.refmesh", [group], Quality(4e-3, 200, QUALITY.balance))
    assert [len(entry.numbers) for entry in reader.entries] == [50, 50]
    assert len(reader.group(1).triangles) <= 200


def test_a_still_mesh_at_a_coarse_step_is_padded_so_that_its_counts_are_believed(tmp_path):
    mesh = shapes.ball(4)
    still = FrameGroup(tuple(range(64)), np.repeat(mesh.vertices[None], 64, axis=0), mesh.triangles)
    reader = written(tmp_path / "still.refmesh", [still], Quality(step=0.3))
    assert reader.group(0).positions.shape == (64, len(mesh.vertices), 3)


def test_the_error_is_told_and_the_size_estimated_from_a_few_frames(tmp_path):
    mesh = shapes.ball(4)
    group = FrameGroup(tuple(range(12)), waving(mesh, 12), mesh.triangles)
    path = tmp_path / "told.refmesh"
    error = write_stream(path, [group], DIAGONAL, 25.0, QUALITY)
    decoded = StreamReader(path).group(0)
    distances = [SurfaceIndex(TriangleMesh(a, group.triangles)).query(b).distances for a, b in zip(group.positions, decoded.positions)]
    assert 0.7 * error < np.sqrt(np.mean(np.square(distances))) < 1.1 * error
    estimate = estimated([group], DIAGONAL, 25.0, QUALITY)
    assert 0.67 < estimate.size / path.stat().st_size < 1.5
    assert 0.5 < estimate.error * DIAGONAL / error < 2.0


def test_what_cannot_be_coded_is_refused_and_leaves_no_file(tmp_path):
    mesh = shapes.ball(2)
    path = tmp_path / "refused.refmesh"
    whole = mesh.vertices[None]
    doubled = np.vstack([mesh.triangles, [[0, 0, 1]]])
    broken = np.where(np.arange(3) == 1, np.nan, whole)
    for group, says in (
        (FrameGroup((7,), whole, doubled), "frames 7 to 7: a triangle that has one vertex twice"),
        (FrameGroup((7,), broken, mesh.triangles), "frames 7 to 7: positions that are not finite"),
    ):
        with pytest.raises(RefMeshError, match=says):
            written(path, [group])
    with pytest.raises(RefMeshError, match="requested error is too small"):
        written(path, [FrameGroup((7,), whole, mesh.triangles)], Quality(step=1e-9))
    with pytest.raises(RefMeshError, match="without extent"):
        written(path, [FrameGroup((7,), whole, mesh.triangles)], diagonal=0.0)
    assert not list(tmp_path.iterdir())


def test_files_that_are_missing_or_foreign_are_refused_by_name(tmp_path):
    with pytest.raises(RefMeshError, match="gone.refmesh: cannot be read"):
        StreamReader(tmp_path / "gone.refmesh")
    (tmp_path / "foreign.refmesh").write_bytes(b"ply\n" * 100)
    with pytest.raises(RefMeshError, match="foreign.refmesh: is not a .refmesh file"):
        StreamReader(tmp_path / "foreign.refmesh")


def test_a_missing_package_is_told_in_words(monkeypatch, reader):
    real = builtins.__import__

    def without(name, *arguments, **options):
        if name == "constriction":
            raise ImportError(name)
        return real(name, *arguments, **options)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(RefMeshError, match="need the Python package 'constriction', which is not installed"):
        reader.group(0)
