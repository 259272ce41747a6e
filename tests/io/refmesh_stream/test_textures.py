import json

import numpy as np
import pytest
from PIL import Image

from refmesh_addon.core.color.appearance import sampled
from refmesh_addon.core.color.projected_layout import projected_layout
from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.io.files import read_npz, write_npz
from refmesh_addon.io.refmesh_stream.reader import StreamReader
from refmesh_addon.io.refmesh_stream.textures import read_texture, textures_folder, write_textures
from refmesh_addon.io.refmesh_stream.writer import FrameGroup, Quality, write_stream
from tests.core import shapes
from tests.io.refmesh_stream.bodies import torus_groups
from tests.io.small_glb.test_surface import painted, place_colors

pytest.importorskip("constriction")


@pytest.fixture
def stream(tmp_path):
    """A long textured group, which becomes two runs of frames, and one without colors."""
    torus = shapes.torus()
    still = painted(FrameGroup(tuple(range(70)), np.repeat(torus.vertices[None], 70, axis=0), torus.triangles))
    groups = [still, FrameGroup((80, 81), torus_groups()[1].positions, torus_groups()[1].triangles)]
    path = tmp_path / "take.refmesh"
    write_stream(path, groups, 4.0, 30.0, Quality(2e-3))
    write_textures(path, groups, 128, projected_layout)
    return path


def test_decoded_triangles_have_the_colors_of_their_places(stream):
    reader = StreamReader(stream)
    group = reader.group(1)
    texture = read_texture(stream, 1, len(group.triangles))
    assert texture.picture == read_texture(stream, 0, len(group.triangles)).picture
    shown = sampled(np.array(Image.open(texture.picture).convert("RGB")), texture.layout.corners.mean(axis=1))
    places = group.positions[0][group.triangles].mean(axis=1)
    assert np.median(np.abs(shown - place_colors(places, shapes.torus().vertices)).max(axis=1)) < 8.0


def test_a_group_without_colors_has_no_texture(stream):
    assert read_texture(stream, 2, 320) is None
    assert sorted(path.name for path in textures_folder(stream).iterdir()) == ["group_000.webp", "group_000_layout.npz", "textures.json"]


def test_streams_without_textures_write_no_folder(tmp_path):
    path = tmp_path / "plain.refmesh"
    write_stream(path, torus_groups(), 4.0, 30.0, Quality(2e-3))
    assert write_textures(path, torus_groups(), 128, projected_layout) == []
    assert not textures_folder(path).exists() and read_texture(path, 0, 1024) is None


@pytest.mark.parametrize("names", [["../elsewhere", "", ""], [], {}, ["group_007", "", ""]])
def test_textures_of_another_stream_are_refused(stream, names):
    (textures_folder(stream) / "textures.json").write_text(json.dumps(names))
    with pytest.raises(RefMeshError, match="textures.json: the textures do not belong to the stream"):
        read_texture(stream, 0, 1024)


def test_a_layout_of_another_mesh_is_refused(stream):
    with pytest.raises(RefMeshError, match="group_000_layout.npz is of another mesh"):
        read_texture(stream, 0, 1000)


@pytest.mark.parametrize("changed", [{"uvs": np.full((900, 2), np.nan)}, {"uvs": np.zeros((2, 2))}, {"more": np.zeros(1)}])
def test_a_layout_with_other_arrays_is_refused(stream, changed):
    path = textures_folder(stream) / "group_000_layout.npz"
    write_npz(path, {**read_npz(path), **changed})
    with pytest.raises(RefMeshError, match="group_000_layout.npz is damaged"):
        read_texture(stream, 0, 1024)


def test_an_index_that_is_nested_without_end_is_refused(stream):
    (textures_folder(stream) / "textures.json").write_text("[" * 100_000)
    with pytest.raises(RefMeshError, match="textures.json: the textures do not belong to the stream"):
        read_texture(stream, 0, 1)
