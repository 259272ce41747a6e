import io
import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from refmesh_addon.core.color.appearance import Appearance, sampled
from refmesh_addon.core.color.frame import textured
from refmesh_addon.core.color.projected_layout import projected_layout
from refmesh_addon.core.color.texels import Texels
from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.refmesh_stream.writer import FrameGroup
from refmesh_addon.io.small_glb import surface
from refmesh_addon.io.small_glb.choice import SmallGlb
from refmesh_addon.io.small_glb.writer import write_small_glb
from tests.core import shapes
from tests.io.refmesh_stream.bodies import torus_groups, waving
from tests.io.small_glb.programs import VALIDATE, node
from tests.io.small_glb.unpacking import Glb

DIAGONAL, RATE = 4.0, 30.0
CHOICE = SmallGlb(error=4e-3, triangles=(2000,), texture=256, image=".png")
GRAY_LEVELS = 4.0  # that a texel of 1/256 of the side and the error allowed may change a smooth color by


def place_colors(points, rest):
    """(N, 3) smooth colors that depend on the place on the surface at rest."""
    low, high = rest.min(axis=0), rest.max(axis=0)
    return 40.0 + 170.0 * (points - low) / (high - low)


def painted(group):
    """The group with a texture of those colors."""
    mesh = TriangleMesh(group.positions[0], group.triangles)
    layout = projected_layout(mesh)
    texels = Texels.of(layout, 256)
    image = texels.image(np.rint(place_colors(texels.points(mesh), mesh.vertices)).astype(np.uint8))
    return replace(group, appearance=textured(mesh, layout, image))


def tinted(group):
    """The group with those colors at its vertices."""
    mesh = TriangleMesh(group.positions[0], group.triangles)
    corners = np.rint(place_colors(mesh.vertices[mesh.triangles], mesh.vertices)).astype(np.uint8)
    count = len(mesh.triangles)
    return replace(group, appearance=Appearance(mesh, np.zeros((count, 3, 2), np.float32), np.full(count, -1), corners))


def still(mesh, frames=2):
    return FrameGroup(tuple(range(frames)), np.repeat(mesh.vertices[None], frames, axis=0), mesh.triangles)


def written(path, groups, choice=CHOICE):
    write_small_glb(path, groups, DIAGONAL, RATE, choice)
    return Glb(path.read_bytes())


def picture(glb, index=0):
    view = glb.json["bufferViews"][glb.json["images"][index]["bufferView"]]
    return np.array(Image.open(io.BytesIO(glb._view(view))).convert("RGB"))


def attribute(glb, mesh, name):
    return glb.accessor(glb.json["meshes"][mesh]["primitives"][0]["attributes"][name])


@pytest.mark.parametrize("image", [".png", ".jpg", ".webp"])
def test_every_triangle_has_the_color_of_its_place_in_the_texture(tmp_path, image):
    mesh = shapes.torus()
    choice = replace(CHOICE, image=image, triangles=(600, 2000))
    glb = written(tmp_path / "painted.glb", [painted(still(mesh))], choice)
    vertices, triangles = glb.at(0.0)
    uvs = attribute(glb, 0, "TEXCOORD_0") / 65535.0 * [1, -1] + [0, 1]
    shown, expected = sampled(picture(glb), uvs[triangles].mean(axis=1)), place_colors(vertices[triangles].mean(axis=1), mesh.vertices)
    difference = np.abs(shown - expected).max(axis=1)
    assert np.quantile(difference, 0.95) < 3 * GRAY_LEVELS  # where charts of this plain layout overlap, triangles share texels
    assert np.median(difference) < GRAY_LEVELS


def test_colors_of_vertices_are_stored_as_light(tmp_path):
    mesh = shapes.torus()
    glb = written(tmp_path / "tinted.glb", [tinted(still(mesh))], replace(CHOICE, error=1e-3))
    light = attribute(glb, 0, "COLOR_0") / 65535.0
    encoded = 255.0 * np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    assert np.abs(encoded - place_colors(glb.at(0.0)[0], mesh.vertices)).max() < GRAY_LEVELS
    assert "images" not in glb.json


@pytest.mark.parametrize("color", [painted, tinted])
@pytest.mark.parametrize("choice", [{"image": ".png"}, {"image": ".jpg", "packed": True}, {"image": ".webp", "packed": True}])
def test_the_khronos_validator_finds_nothing_wrong(tmp_path, color, choice):
    path = tmp_path / "colored.glb"
    written(path, [color(group) for group in torus_groups()], replace(CHOICE, **choice))
    issues = json.loads(node(VALIDATE, path, "gltf-validator"))
    assert issues["numErrors"] == issues["numWarnings"] == 0
    assert {message["code"] for message in issues["messages"]} <= {"UNSUPPORTED_EXTENSION"}


def test_runs_of_a_segment_share_its_triangles_and_texture(tmp_path):
    mesh = shapes.torus()
    group = painted(FrameGroup(tuple(range(8)), waving(mesh, 8), mesh.triangles))
    choice = replace(CHOICE, error=2e-4, targets=(1, 2))
    glb = written(tmp_path / "runs.glb", [group], choice)
    parts = [each["primitives"][0] for each in glb.json["meshes"]]
    assert len(parts) > 1 and len(glb.json["images"]) == len(glb.json["materials"]) == 1
    assert len({(part["indices"], part["attributes"]["TEXCOORD_0"]) for part in parts}) == 1
    for frame, positions in enumerate(group.positions):
        assert np.abs(np.sort(glb.at(frame / RATE)[0].max(axis=0)) - np.sort(positions.max(axis=0))).max() < 0.05


def test_a_texture_is_no_larger_than_allowed_and_than_it_was(tmp_path):
    groups = [painted(still(shapes.torus()))]
    for allowed, side in ((100, 64), (128, 128), (4096, 256)):
        assert picture(written(tmp_path / "size.glb", groups, replace(CHOICE, texture=allowed))).shape == (side, side, 3)
    assert "images" not in written(tmp_path / "size.glb", groups, replace(CHOICE, texture=0)).json


def test_a_surface_with_a_border_is_drawn_from_both_sides(tmp_path):
    closed, half = shapes.ball(2), shapes.ball(2)
    half = TriangleMesh(half.vertices, half.triangles[half.vertices[half.triangles].mean(axis=1)[:, 2] > 0])
    used, triangles = np.unique(half.triangles, return_inverse=True)
    opened = TriangleMesh(half.vertices[used], triangles.reshape(-1, 3))
    for mesh, sides in ((closed, False), (opened, True)):
        glb = written(tmp_path / "sides.glb", [still(mesh)])
        assert glb.json["materials"][0].get("doubleSided", False) == sides


def test_a_missing_pillow_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(surface, "images_available", lambda: False)
    with pytest.raises(RefMeshError, match="textures need the Python package 'pillow'"):
        written(tmp_path / "none.glb", [painted(still(shapes.torus()))])
