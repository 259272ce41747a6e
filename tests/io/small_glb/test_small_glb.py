import json
from dataclasses import replace

import numpy as np
import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.refmesh_stream.writer import FrameGroup
from refmesh_addon.io.small_glb.choice import SmallGlb
from refmesh_addon.io.small_glb.writer import within_rate, write_small_glb
from tests.core import shapes
from tests.io.refmesh_stream.bodies import torus_groups
from tests.io.small_glb.programs import VALIDATE, node
from tests.io.small_glb.unpacking import Glb

DIAGONAL, RATE = 4.0, 30.0
CHOICE = SmallGlb(error=2e-3, triangles=(2000,))
UNPACK = """
const fs = require('fs');
import(process.env.NODE_PATH + '/meshoptimizer/meshopt_decoder.mjs').then(async ({ MeshoptDecoder }) => {
  await MeshoptDecoder.ready;
  const file = fs.readFileSync(process.argv[1]), length = file.readUInt32LE(12);
  for (const view of JSON.parse(file.subarray(20, 20 + length)).bufferViews) {
    const packed = view.extensions && view.extensions.EXT_meshopt_compression;
    if (!packed) continue;
    const target = new Uint8Array(packed.count * packed.byteStride), start = 28 + length + packed.byteOffset;
    MeshoptDecoder.decodeGltfBuffer(target, packed.count, packed.byteStride, file.subarray(start, start + packed.byteLength), packed.mode);
    console.log(Buffer.from(target).toString('hex'));
  }
});
"""


def written(path, groups, choice=CHOICE):
    result = write_small_glb(path, groups, DIAGONAL, RATE, choice)
    return Glb(path.read_bytes()), result


@pytest.fixture(scope="module", params=[False, True], ids=["plain", "packed"])
def path(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("glb") / "torus.glb"
    written(path, torus_groups(), SmallGlb(error=2e-3, triangles=(2000,), packed=request.param))
    return path


def test_every_frame_is_shown_at_its_time(path):
    glb = Glb(path.read_bytes())
    for group in torus_groups():
        for number, positions in zip(group.numbers, group.positions):
            vertices, triangles = glb.at((number - 4) / RATE)
            distances = SurfaceIndex(TriangleMesh(positions, group.triangles)).query(vertices).distances
            assert len(triangles) == len(group.triangles)
            assert np.sqrt((distances**2).mean()) < 2 * CHOICE.error * DIAGONAL


def test_one_group_is_shown_at_any_time(path):
    glb = Glb(path.read_bytes())
    for time in np.linspace(0.0, 10.0 / RATE, 200):
        glb.at(time)


def test_the_khronos_validator_finds_nothing_wrong(path):
    issues = json.loads(node(VALIDATE, path, "gltf-validator"))
    assert issues["numErrors"] == issues["numWarnings"] == 0
    assert {message["code"] for message in issues["messages"]} <= {"UNSUPPORTED_EXTENSION"}


def test_the_decoder_of_meshoptimizer_reads_what_our_plain_one_reads(path):
    glb = Glb(path.read_bytes())
    views = [view for view in glb.json["bufferViews"] if "extensions" in view]
    assert node(UNPACK, path, "meshoptimizer").split() == [bytes(glb._view(view)).hex() for view in views]


def test_packed_files_are_smaller_and_hold_the_same(tmp_path):
    plain, _ = written(tmp_path / "plain.glb", torus_groups())
    packed, _ = written(tmp_path / "packed.glb", torus_groups(), SmallGlb(error=2e-3, triangles=(2000,), packed=True))
    assert (tmp_path / "packed.glb").stat().st_size < 0.6 * (tmp_path / "plain.glb").stat().st_size
    for time in (0.0, 1 / RATE, 4 / RATE):
        np.testing.assert_array_equal(packed.at(time)[0], plain.at(time)[0])


def test_the_same_frames_give_the_same_bytes(tmp_path):
    for name in ("first.glb", "second.glb"):
        written(tmp_path / name, torus_groups())
    assert (tmp_path / "first.glb").read_bytes() == (tmp_path / "second.glb").read_bytes()


def test_what_was_reached_is_told(tmp_path):
    _, groups = written(tmp_path / "reached.glb", torus_groups())
    assert [group.numbers for group in groups] == [(4, 5, 6), (8, 9)]
    assert all(group.error <= CHOICE.error for group in groups)


def test_an_error_that_cannot_be_reached_is_refused_and_what_can_is_told(tmp_path):
    with pytest.raises(RefMeshError, match=r"frames 4 to 6: an error of 0.2 % cannot be reached .* 60 triangles: allow [0-9.]+ %"):
        written(tmp_path / "missed.glb", torus_groups(), SmallGlb(error=2e-3, triangles=(60,)))
    assert not list(tmp_path.iterdir())


def test_a_placement_turns_and_moves_everything(tmp_path):
    placement = np.array([[0.0, 0, 1, 5], [1, 0, 0, 6], [0, 1, 0, 7], [0, 0, 0, 1]])
    plain, _ = written(tmp_path / "plain.glb", torus_groups())
    placed, _ = written(tmp_path / "placed.glb", torus_groups(), replace(CHOICE, placement=placement))
    for time in (0.0, 4 / RATE):
        np.testing.assert_allclose(placed.at(time)[0], plain.at(time)[0] @ placement[:3, :3].T + placement[:3, 3], atol=1e-9)


def test_a_single_frame_is_a_plain_mesh(tmp_path):
    mesh = shapes.ball(2)
    glb, _ = written(tmp_path / "one.glb", [FrameGroup((7,), mesh.vertices[None], mesh.triangles)])
    assert "animations" not in glb.json and "weights" not in glb.json["meshes"][0]
    np.testing.assert_allclose(np.sort(glb.at(0.0)[0], axis=0), np.sort(mesh.vertices, axis=0), atol=4e-2)


def test_an_error_too_small_for_16_bits_is_refused(tmp_path):
    with pytest.raises(RefMeshError, match="frames 4 to 6: an error that small needs more than 16 bits"):
        written(tmp_path / "fine.glb", torus_groups(), SmallGlb(error=1e-6, triangles=(2000,)))
    assert not list(tmp_path.iterdir())


def test_a_rate_is_kept_with_the_smallest_error_that_fits(tmp_path):
    group = torus_groups()[0]
    loose, tight = (within_rate(group, DIAGONAL, RATE, CHOICE, mbps) for mbps in (1.9, 1.4))
    assert loose.error < tight.error
    for choice, mbps in ((loose, 1.9), (tight, 1.4)):
        written(tmp_path / "rate.glb", [group], choice)
        assert 8e-6 * (tmp_path / "rate.glb").stat().st_size * RATE / len(group.numbers) <= mbps


def test_a_rate_that_cannot_be_reached_is_refused_and_what_can_is_told():
    with pytest.raises(RefMeshError, match=r"0.01 Mbit/s cannot be reached, [0-9.]+ can"):
        within_rate(torus_groups()[0], DIAGONAL, RATE, CHOICE, 0.01)
