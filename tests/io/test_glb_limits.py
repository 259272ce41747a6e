import json
import struct

import pytest
import trimesh

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.io import trimesh_reader
from refmesh_addon.io.glb_limits import check_glb
from refmesh_addon.io.meshes import parse_mesh

BALL = trimesh.creation.icosphere(subdivisions=1).export(file_type="glb")


def packed(text, rest=b""):
    text += b" " * (-len(text) % 4)
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest


def changed(change):
    """The ball with its JSON changed."""
    length = struct.unpack_from("<I", BALL, 12)[0]
    gltf = json.loads(BALL[20 : 20 + length])
    change(gltf)
    return packed(json.dumps(gltf).encode(), BALL[20 + length :])


def test_a_file_that_nothing_is_wrong_with_passes():
    check_glb(BALL)
    assert len(parse_mesh(changed(lambda gltf: None), "frame.glb").triangles) == 80


@pytest.mark.parametrize(
    ("extension", "remedy"),
    [
        ("KHR_draco_mesh_compression", "Draco-compressed, which is not read: export it again without"),
        ("EXT_meshopt_compression", "meshopt"),
    ],
)
def test_compressed_meshes_are_named_with_what_to_do(extension, remedy):
    with pytest.raises(RefMeshError, match=rf"^frame\.glb: .*{remedy}.*gltf-transform copy"):
        parse_mesh(changed(lambda gltf: gltf.update(extensionsRequired=[extension], extensionsUsed=[extension])), "frame.glb")


@pytest.mark.parametrize("count", [10**8, -1, "80", None, 1e8])
@pytest.mark.parametrize("with_buffer", [True, False])
def test_counts_are_held_against_the_bytes(count, with_buffer):
    def change(gltf):
        gltf["accessors"][0]["count"] = count
        if not with_buffer:
            del gltf["accessors"][0]["bufferView"]

    with pytest.raises(RefMeshError, match=r"accessor 0 declares .* more than the \d+ bytes of the file hold"):
        parse_mesh(changed(change), "frame.glb")


def test_views_are_held_against_the_bytes():
    with pytest.raises(RefMeshError, match="bufferView 0 declares 1000000000 bytes"):
        parse_mesh(changed(lambda gltf: gltf["bufferViews"][0].update(byteLength=10**9)), "frame.glb")


@pytest.mark.parametrize("text", [b"[" * 40_000, b'{"a":' * 20_000, b'{"nodes":[' * 100 + b"]}" * 100])
def test_nested_json_is_refused_by_name(text):
    with pytest.raises(RefMeshError, match=r"^frame\.glb: .*nested more than 64 levels"):
        parse_mesh(packed(text), "frame.glb")


@pytest.mark.parametrize(
    "text", [b"[]", b"3", b'{"accessors": 3}', b'{"accessors": [3]}', b'{"bufferViews": [null]}', b"{", b'{"asset": NaN}']
)
def test_json_of_another_shape_is_refused_by_name(text):
    with pytest.raises(RefMeshError, match=r"^frame\.glb: "):
        parse_mesh(packed(text), "frame.glb")


def test_instances_are_all_there_up_to_a_limit(monkeypatch):
    def change(gltf):
        mesh = next(node["mesh"] for node in gltf["nodes"] if "mesh" in node)
        gltf["nodes"] = [{"children": list(range(1, 2001))}] + [{"mesh": mesh}] * 2000
        gltf["scenes"], gltf["scene"] = [{"nodes": [0]}], 0

    assert len(parse_mesh(changed(change), "frame.glb").triangles) == 80 * 2000
    monkeypatch.setattr(trimesh_reader, "MOST_INSTANCED", 100_000)
    with pytest.raises(RefMeshError, match="placed several times, have 160000 triangles together, more than 100000"):
        parse_mesh(changed(change), "frame.glb")


def test_a_chunk_longer_than_the_file_is_refused():
    with pytest.raises(ValueError, match="truncated: its header declares"):
        check_glb(BALL[:-10])
    with pytest.raises(ValueError, match="no glTF header"):
        check_glb(b"x" + BALL[1:])
