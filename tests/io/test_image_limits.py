"""Small files that stand for much: refused before memory is taken, and nothing is read twice."""

import io
import json
import struct

import numpy as np
import pytest
from PIL import Image

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.io.appearance import parse_appearance
from refmesh_addon.io.images import decoded
from refmesh_addon.io.meshes import parse_mesh
from refmesh_addon.io.textures import missing_textures


def png(side, mode="P"):
    file = io.BytesIO()
    Image.new(mode, (side, side)).save(file, "PNG", optimize=True)
    return file.getvalue()


@pytest.mark.parametrize("mode", ["1", "P", "L"])
def test_a_picture_of_one_color_is_read_unless_it_would_fill_the_memory(mode):
    assert decoded(png(2048, mode), "a.png").shape == (2048, 2048, 3)
    with pytest.raises(RefMeshError, match="^a.png: declares 225000000 pixels in [0-9]+ bytes"):
        decoded(png(15_000, mode), "a.png")


def test_primitives_that_share_their_vertices_without_end_are_refused():
    positions = np.random.default_rng(0).random((4500, 3)).astype("<f4").tobytes()

    def glb(primitives):
        gltf = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}]}
        gltf |= {"meshes": [{"primitives": [{"attributes": {"POSITION": 0}}] * primitives}]}
        gltf |= {"accessors": [{"bufferView": 0, "componentType": 5126, "count": 4500, "type": "VEC3"}]}
        gltf |= {"bufferViews": [{"buffer": 0, "byteLength": len(positions)}], "buffers": [{"byteLength": len(positions)}]}
        text = json.dumps(gltf).encode()
        text += b" " * (-len(text) % 4)
        head = struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(positions), len(text), 0x4E4F534A)
        return head + text + struct.pack("<II", len(positions), 0x004E4942) + positions

    assert len(parse_mesh(glb(3), "a.glb").triangles) == 4500
    with pytest.raises(RefMeshError, match="a.glb: .*primitives have 5850000 vertices"):
        parse_mesh(glb(1300), "a.glb")


def test_a_picture_with_many_names_is_decoded_once(tmp_path, monkeypatch):
    (tmp_path / "skin.png").write_bytes(png(16, "L"))
    names = ["skin.png", "./skin.png", "SKIN.png", "no/../skin.png"]
    (tmp_path / "a.mtl").write_text("".join(f"newmtl m{index}\nmap_Kd {name}\n" for index, name in enumerate(names)))
    faces = "".join(f"usemtl m{index}\nf 1/1 2/1 3/1\n" for index in range(len(names)))
    data = f"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n{faces}".encode()
    appearance, notes, _ = parse_appearance(data, tmp_path / "a.obj")
    assert len(appearance.images) == 1 and set(appearance.materials.tolist()) == {0}


def test_thousands_of_missing_names_list_a_folder_once(tmp_path, monkeypatch):
    (tmp_path / "a.mtl").write_text("".join(f"newmtl m{index}\nmap_Kd x{index}.png\n" for index in range(3000)))
    listed = []
    walk = type(tmp_path).iterdir
    monkeypatch.setattr(type(tmp_path), "iterdir", lambda self: listed.append(self) or walk(self))
    assert len(missing_textures(b"mtllib a.mtl\nv 0 0 0\n", tmp_path / "a.obj")) == 3000
    assert len(listed) == 1
