"""The compressed exports: read back by Blender's own importer of glTF, and by the operators that decode and import streams."""

from __future__ import annotations

import json
import re
from importlib.util import find_spec

import bpy
import numpy as np
import pytest

from refmesh_addon.bridge.scene.meshes import read_positions
from refmesh_addon.core.color.projected_layout import projected_layout
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.io.files import write_npz
from refmesh_addon.io.images import write_image
from refmesh_addon.io.ply import read_surface
from refmesh_addon.io.refmesh_stream.reader import StreamReader
from refmesh_addon.io.web_page.writer import viewer_problem

from .conftest import GROUPS, NUMBERS, place, reference

needs_constriction = pytest.mark.skipif(not find_spec("constriction"), reason="the package 'constriction' is not installed")
TOLERANCE = 0.02  # scene units; the ball is some 2 across


def true_surface(index: int, number: int, upright: bool) -> SurfaceIndex:
    """Of the ball in a frame, in the input's coordinates or turned upright as Blender shows it."""
    mesh = reference(index)
    x, y, z = place(mesh.vertices, number).T
    return SurfaceIndex(mesh.moved(np.column_stack([x, -z, y] if upright else [x, y, z])))


def world_positions(member: bpy.types.Object) -> np.ndarray:
    evaluated = member.evaluated_get(bpy.context.evaluated_depsgraph_get())
    matrix = np.array(evaluated.matrix_world)
    return read_positions(evaluated.data) @ matrix[:3, :3].T + matrix[:3, 3]


def test_a_small_glb_plays_in_blender_frame_by_frame(blender, solved, results):
    blender.ops.refmesh.export(format="glb", glb_size="small", glb_error=0.1)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.import_scene.gltf(filepath=str(results / "export" / "ball.glb"))
    bodies = sorted((item for item in bpy.data.objects if item.type == "MESH"), key=lambda item: int(item.parent.name.split()[1]))
    for number in NUMBERS:
        bpy.context.scene.frame_set(number - NUMBERS[0])
        for index, numbers in enumerate(GROUPS):
            positions = world_positions(bodies[index])
            if number in numbers:
                assert true_surface(index, number, upright=True).query(positions).distances.max() < TOLERANCE
            else:
                assert np.ptp(positions, axis=0).max() < 1e-6


@pytest.fixture
def textured(solved, results):
    """Results whose group k has the steady texture 100 + 50 k."""
    report = json.loads((results / "report.json").read_text())
    (results / "texture").mkdir()
    for index, group in enumerate(report["groups"]):
        layout = projected_layout(reference(index))
        group["layout"], group["texture"] = f"texture/group_{index:03d}_layout.npz", f"texture/group_{index:03d}_steady.png"
        write_npz(results / group["layout"], {"uvs": layout.uvs, "triangles": layout.triangles})
        write_image(results / group["texture"], np.full((128, 128, 3), 100 + 50 * index, np.uint8))
    (results / "report.json").write_text(json.dumps(report))
    return solved


def shown_levels(body):
    """(N, 3) gray levels of the picture of an object's only material."""
    (picture,) = [node.image for node in body.data.materials[0].node_tree.nodes if node.type == "TEX_IMAGE"]
    pixels = np.empty(picture.size[0] * picture.size[1] * 4, np.float32)
    picture.pixels.foreach_get(pixels)
    return 255 * pixels.reshape(-1, 4)[:, :3]


@pytest.mark.parametrize("image", ["webp", "png", "jpg"])
def test_a_small_glb_shows_the_steady_texture_in_blender(blender, textured, results, image):
    blender.ops.refmesh.export(format="glb", glb_size="small", glb_error=0.1, glb_image=image)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.import_scene.gltf(filepath=str(results / "export" / "ball.glb"))
    bodies = sorted((item for item in bpy.data.objects if item.type == "MESH"), key=lambda item: int(item.parent.name.split()[1]))
    for index, body in enumerate(bodies):
        assert np.abs(shown_levels(body) - (100 + 50 * index)).max() < 3
        assert len(body.data.uv_layers) == 1


@pytest.mark.skipif(bool(viewer_problem()), reason=viewer_problem() or "-")
def test_a_web_page_holds_the_small_glb(blender, solved, results):
    blender.ops.refmesh.export(format="web", web_error=0.1)
    blender.ops.refmesh.export(format="glb", glb_size="small", glb_error=0.1, glb_packed=True)
    folder = results / "export" / "ball_web"
    assert sorted(path.name for path in folder.iterdir()) == ["ball.glb", "ball.glb.js", "index.html", "viewer.js"]
    assert (folder / "ball.glb").read_bytes() == (results / "export" / "ball.glb").read_bytes()


def figures(text):
    """(megabytes, share of the diagonal) of what is told of a file."""
    return float(re.search(r"([\d.e-]+) MB", text)[1]), float(re.search(r"RMS error ([\d.e-]+) %", text)[1]) / 100


@needs_constriction
@pytest.mark.parametrize("quality", ["small", "balanced", "near_lossless"])
def test_size_and_error_are_estimated_and_told(blender, solved, results, quality):
    state = solved.refmesh
    state.export_quality = quality
    blender.ops.refmesh.estimate_export()
    estimates = dict(line.split(": ", 1) for line in state.export_estimates.splitlines())
    for kind, arguments in (
        ("glTF Binary, small", {"format": "glb", "glb_size": "small", "glb_quality": quality}),
        ("RefMesh Stream", {"format": "refmesh", "refmesh_quality": quality}),
    ):
        blender.ops.refmesh.export(**arguments)
        extension = {"glb": ".glb", "refmesh": ".refmesh"}[arguments["format"]]
        size, error = figures(state.exported)
        assert size == pytest.approx((results / "export" / f"ball{extension}").stat().st_size / 1e6, rel=0.06)
        assert figures(estimates[kind])[0] == pytest.approx(size, rel=0.5)
        assert error <= 1.1 * figures(estimates[kind])[1]
    state.export_quality = "small" if quality == "balanced" else "balanced"
    assert not state.export_estimates


def test_a_range_that_cuts_a_group_leaves_out_the_rest(blender, solved, results):
    blender.ops.refmesh.export(format="glb", glb_size="small", glb_error=0.1, first=7, last=10)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.import_scene.gltf(filepath=str(results / "export" / "ball.glb"))
    names = {item.parent.name for item in bpy.data.objects if item.type == "MESH"}
    assert names == {"frames 7 to 8", "frames 10 to 10"}


def test_a_small_glb_is_smaller(blender, solved, results):
    sizes = []
    for size in ("full", "small"):
        blender.ops.refmesh.export(format="glb", glb_size=size, glb_error=0.1)
        sizes.append((results / "export" / "ball.glb").stat().st_size)
    assert sizes[1] < sizes[0]


@needs_constriction
def test_a_stream_comes_back_as_files_and_as_objects(blender, solved, results):
    blender.ops.refmesh.export(format="refmesh", refmesh_quality="near_lossless")
    path = results / "export" / "ball.refmesh"
    assert [entry.numbers for entry in StreamReader(path).entries] == list(GROUPS)
    blender.ops.refmesh.decode_stream(filepath=str(path), output=str(results / "decoded"))
    for index, numbers in enumerate(GROUPS):
        for number in numbers:
            decoded = read_surface(results / "decoded" / f"frame_{number:04d}.ply")
            assert true_surface(index, number, upright=False).query(decoded.vertices).distances.max() < TOLERANCE / 10
    blender.ops.refmesh.import_stream(filepath=str(path))
    members = [item for item in bpy.context.view_layer.objects.active.children if item.type == "MESH"]
    assert len(members) == len(GROUPS) and (results / "export" / "ball").is_dir()
    for number in NUMBERS:
        bpy.context.scene.frame_set(number - NUMBERS[0] + 1)
        for index, numbers in enumerate(GROUPS):
            member = next(item for item in members if item.name.endswith(f"group_{index:03d}"))
            assert member.hide_viewport == (number not in numbers)
            if number in numbers:
                member.hide_viewport = False
                assert true_surface(index, number, upright=True).query(world_positions(member)).distances.max() < TOLERANCE / 10


@needs_constriction
def test_textures_beside_a_stream_are_shown(blender, textured, results):
    blender.ops.refmesh.export(format="refmesh", refmesh_texture=64)
    blender.ops.refmesh.import_stream(filepath=str(results / "export" / "ball.refmesh"))
    members = sorted((item for item in bpy.context.view_layer.objects.active.children if item.type == "MESH"), key=lambda item: item.name)
    for index, member in enumerate(members):
        assert np.abs(shown_levels(member) - (100 + 50 * index)).max() < 3
        assert len(member.data.uv_layers) == 1


@needs_constriction
def test_a_damaged_stream_is_refused_in_words(blender, tmp_path):
    (tmp_path / "damaged.refmesh").write_bytes(b"\x8fRefMesh\x01\x00" + bytes(40))
    with pytest.raises(RuntimeError, match="damaged.refmesh: was not written to its end"):
        blender.ops.refmesh.decode_stream(filepath=str(tmp_path / "damaged.refmesh"))
    with pytest.raises(RuntimeError, match="damaged.refmesh: was not written to its end"):
        blender.ops.refmesh.import_stream(filepath=str(tmp_path / "damaged.refmesh"))


@needs_constriction
def test_neither_decoding_nor_importing_a_stream_replaces_a_file_of_the_users(blender, solved, results, tmp_path):
    blender.ops.refmesh.export(format="refmesh")
    path, folder = results / "export" / "ball.refmesh", tmp_path / "taken"
    folder.mkdir()
    for name, operator in (("frame_0006.ply", "decode_stream"), ("ball_group_000.pc2", "import_stream")):
        (folder / name).write_bytes(b"mine")
        with pytest.raises(RuntimeError, match=f"{name}: is another file, which is kept"):
            getattr(blender.ops.refmesh, operator)(filepath=str(path), output=str(folder))
        assert (folder / name).read_bytes() == b"mine"
    for operator in ("decode_stream", "import_stream"):
        for _ in range(2):  # what is there already is what would be written
            getattr(blender.ops.refmesh, operator)(filepath=str(path), output=str(tmp_path / "own"))
