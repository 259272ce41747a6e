"""UV maps that a person adds to results: the next run of Color brings the colors onto them."""

import json
from pathlib import Path

import bpy
import numpy as np
import pytest

from refmesh_addon.bridge.results.own_layouts import keep_own_layouts
from refmesh_addon.bridge.scene.meshes import UV_NAME, added_uvs, corner_vertices, set_uvs
from refmesh_addon.io.own_uvs import read_own_layout
from refmesh_addon.pipeline.session.blender_program import BLENDER
from tests.pipeline.colored_takes import write_textured

from .test_jobs import TINY


def places(mesh, name=UV_NAME) -> np.ndarray:
    values = np.empty(2 * len(mesh.loops), np.float32)
    mesh.uv_layers[name].uv.foreach_get("vector", values)
    return values.reshape(-1, 3, 2)


def write_places(mesh, name, values):
    mesh.uv_layers[name].uv.foreach_set("vector", np.ascontiguousarray(values, np.float32).ravel())


def unwrap(member):
    """As a person does, with what Blender offers, in a UV map of their own."""
    member.data.uv_layers.new(name="Mine").active_render = True
    member.data.uv_layers.active = member.data.uv_layers["Mine"]
    bpy.context.view_layer.objects.active = member
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.cube_project()
    bpy.ops.uv.smart_project(island_margin=0.02)
    bpy.ops.object.mode_set(mode="OBJECT")


def test_colors_come_onto_a_uv_map_that_was_added_to_the_result(blender, tmp_path, monkeypatch):
    """And stay there in the next run; without any map, the next run computes a layout again."""
    monkeypatch.setenv(BLENDER, "")
    output = tmp_path / "out"
    bpy.ops.refmesh.import_sequence(filepath=str(write_textured(tmp_path / "take")), frames="3-4")
    owner = bpy.context.active_object
    bpy.ops.refmesh.run_all(output=str(output), quiet=True, **TINY)
    group = owner.refmesh.groups[0]
    bpy.context.view_layer.update()
    for member in (group.reference, group.deformed):
        member.hide_set(False)
    unwrap(group.deformed)
    mine = places(group.deformed.data, "Mine")

    def colored() -> dict:
        bpy.context.view_layer.objects.active = owner
        assert bpy.ops.refmesh.color(quiet=True) == {"FINISHED"}
        return json.loads((output / "report.json").read_text())["groups"][0]

    assert colored()["layout_source"] == "own"
    for member in (group.reference, group.deformed):
        np.testing.assert_allclose(places(member.data), mine, atol=1e-6)
    picture = (output / "texture" / "frame_0003.png").read_bytes()
    assert colored()["layout_source"] == "own" and (output / "texture" / "frame_0003.png").read_bytes() == picture
    for member in (group.reference, group.deformed):
        while member.data.uv_layers:
            member.data.uv_layers.remove(member.data.uv_layers[0])
    assert keep_own_layouts(owner, output) and not list(output.glob("own_layout_*"))


@pytest.fixture
def laid_out(solved, tmp_path):
    """The sequence object, whose first group has the layout of RefMesh on both objects, and the folder of its layouts."""
    group = solved.refmesh.groups[0]
    for member in (group.reference, group.deformed):
        set_uvs(member.data, np.random.default_rng(0).random((len(member.data.polygons), 3, 2)))
    return solved, Path(tmp_path / "kept")


def test_what_refmesh_wrote_is_no_map_of_the_user(laid_out):
    owner, folder = laid_out
    assert not keep_own_layouts(owner, folder) and not folder.exists()
    assert added_uvs(owner.refmesh.groups[0].reference.data) is None


def test_an_edit_of_the_layout_itself_counts_and_is_kept_once(laid_out):
    owner, folder = laid_out
    mesh = owner.refmesh.groups[0].deformed.data
    edited = 0.5 * places(mesh)
    write_places(mesh, UV_NAME, edited)
    assert keep_own_layouts(owner, folder) and not keep_own_layouts(owner, folder)
    triangles, uvs = read_own_layout(folder / "own_layout_000.npz")
    np.testing.assert_array_equal(uvs, edited)
    np.testing.assert_array_equal(triangles, corner_vertices(mesh).reshape(-1, 3))
    set_uvs(mesh, edited)  # the run has used it
    assert not keep_own_layouts(owner, folder) and (folder / "own_layout_000.npz").exists()


def test_the_map_that_renders_use_counts_and_that_of_the_reference_first(laid_out):
    owner, folder = laid_out
    group = owner.refmesh.groups[0]
    for member, value in ((group.reference, 0.25), (group.deformed, 0.75)):
        member.data.uv_layers.new(name="Mine")
        write_places(member.data, "Mine", np.full((len(member.data.polygons), 3, 2), value))
    assert not keep_own_layouts(owner, folder)  # renders still use that of RefMesh
    group.deformed.data.uv_layers["Mine"].active_render = True
    assert keep_own_layouts(owner, folder)
    assert read_own_layout(folder / "own_layout_000.npz")[1].max() == 0.75
    group.reference.data.uv_layers["Mine"].active_render = True
    assert keep_own_layouts(owner, folder)
    assert read_own_layout(folder / "own_layout_000.npz")[1].max() == 0.25
