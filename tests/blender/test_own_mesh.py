"""A mesh of the user's own: taken from the scene, deformed by a job, and back with its polygons, UV maps, groups and names."""

from __future__ import annotations

import shutil

import bpy
import numpy as np
import pytest
from mathutils import Matrix

import refmesh_addon
from refmesh_addon.bridge.scene.far_origin import RESULTS_OFFSET, offset_of
from refmesh_addon.bridge.scene.meshes import read_positions
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.settings import OVER_REFERENCE
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.own_uvs import own_uvs

from .conftest import place, write_frames
from .test_jobs import TINY

FRAME = 7
ONE_MESH = {"segments": "frames"}


@pytest.fixture
def quads(blender, ball) -> bpy.types.Object:
    """A sphere of quads over frame 7, turned and scaled by its object, with a UV map, a vertex group and an attribute."""
    blender.context.scene.frame_set(ball.refmesh.frames[str(FRAME)].scene_frame)
    blender.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=8)
    mine = blender.context.active_object
    mine.name = mine.data.name = "My Head"
    vertices = place(read_positions(mine.data).astype(float), FRAME)
    mine.data.attributes["position"].data.foreach_set("vector", (vertices / 2.0).astype(np.float32).ravel())
    mine.matrix_world = ball.matrix_world @ Matrix.Scale(2.0, 4)
    mine.vertex_groups.new(name="Top").add([0, 1, 2], 0.5, "REPLACE")
    mine.data.attributes.new("mark", "INT", "POINT").data[3].value = 7
    return mine


def polygons(mesh) -> list[list[int]]:
    return [list(polygon.vertices) for polygon in mesh.polygons]


def run(owner, output, **settings) -> None:
    bpy.context.view_layer.objects.active = owner
    bpy.ops.refmesh.run_all(output=str(output), quiet=True, **(TINY | settings))


def test_it_comes_back_moving_with_all_that_it_had(blender, ball, quads, tmp_path):
    ball.refmesh.output = str(tmp_path / "out")
    assert blender.ops.refmesh.use_own_mesh() == {"FINISHED"}
    assert ball.refmesh.settings.mesh_frame == FRAME
    stored = own_uvs(tmp_path / "out" / "own_mesh.ply")
    triangles = read_mesh(tmp_path / "out" / "own_mesh.ply").triangles
    assert stored.shape == (len(triangles), 3, 2)
    places = {vertex: set() for vertex in range(len(quads.data.vertices))}
    for loop, corner in zip(quads.data.loops, quads.data.uv_layers.active.uv):
        places[loop.vertex_index].add(tuple(np.float32(corner.vector)))
    assert all(tuple(uv) in places[vertex] for vertex, uv in zip(triangles.ravel(), stored.reshape(-1, 2)))
    run(ball, tmp_path / "out")
    (group,) = ball.refmesh.groups
    result = group.deformed
    assert polygons(result.data) == polygons(quads.data)
    uvs = [np.array([tuple(corner.vector) for corner in mesh.uv_layers.active.uv]) for mesh in (result.data, quads.data)]
    np.testing.assert_array_equal(*uvs)
    assert [item.name for item in result.vertex_groups] == ["Top"] and result.vertex_groups["Top"].weight(1) == 0.5
    assert result.data.attributes["mark"].data[3].value == 7
    for number in (6, 11):
        blender.context.scene.frame_set(ball.refmesh.frames[str(number)].scene_frame)
        moved = result.evaluated_get(blender.context.evaluated_depsgraph_get()).data
        sphere = read_positions(quads.data).astype(float) * 2.0
        np.testing.assert_allclose(read_positions(moved).mean(axis=0), place(unplaced(sphere, FRAME), number).mean(axis=0), atol=0.1)


def test_a_mesh_made_over_the_reference_mesh_or_a_result_beside_the_source_is_recognized(blender, ball, tmp_path):
    blender.ops.refmesh.run_all(output=str(tmp_path / "out"), quiet=True, **(TINY | {"segments": "frames"}))
    (group,) = ball.refmesh.groups
    blender.context.scene.frame_set(ball.refmesh.frames[str(FRAME)].scene_frame)
    for original, expected in ((group.reference, OVER_REFERENCE), (group.deformed, FRAME)):
        blender.context.view_layer.update()
        shown = original.evaluated_get(blender.context.evaluated_depsgraph_get())
        mine = bpy.data.objects.new("mine", bpy.data.meshes.new_from_object(shown))
        places = read_positions(mine.data).astype(float)
        mine.matrix_world = original.matrix_world.copy()
        blender.context.collection.objects.link(mine)
        blender.context.view_layer.objects.active = mine
        blender.ops.refmesh.use_own_mesh()
        assert ball.refmesh.settings.mesh_frame == expected
        np.testing.assert_allclose(read_positions(ball.refmesh.own_mesh), places, atol=1e-5)
        bpy.data.objects.remove(mine)


@pytest.fixture(scope="module")
def one_mesh_run(tmp_path_factory):
    """Results of one mesh for the whole take, computed once; the input folder and the output folder."""
    folder = tmp_path_factory.mktemp("take")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    refmesh_addon.register()
    bpy.ops.refmesh.import_sequence(filepath=str(write_frames(folder / "ball")))
    run(bpy.context.active_object, folder / "out", **ONE_MESH)
    refmesh_addon.unregister()
    return folder / "ball", folder / "out"


@pytest.fixture
def one_mesh(blender, one_mesh_run, tmp_path) -> bpy.types.Object:
    """The sequence object with a copy of those results."""
    frames, output = one_mesh_run
    blender.ops.refmesh.import_sequence(filepath=str(frames))
    blender.ops.refmesh.load_results(output=str(shutil.copytree(output, tmp_path / "out")))
    return blender.context.active_object


def test_quadriflow_turns_a_copy_of_the_reference_mesh_into_the_mesh_of_the_take(blender, one_mesh, tmp_path):
    reference, active = one_mesh.refmesh.groups[0].reference, blender.context.active_object
    before, objects = (polygons(reference.data), read_positions(reference.data).tolist()), set(bpy.data.objects)
    reference.rotation_euler[2] = 0.5
    assert blender.ops.refmesh.remesh_to_quads() == {"FINISHED"}
    (quads,) = set(bpy.data.objects) - objects
    assert (polygons(reference.data), read_positions(reference.data).tolist()) == before and blender.context.active_object == active
    assert {len(polygon) for polygon in polygons(quads.data)} == {4} and quads.name == "ball quads" and quads.hide_render
    assert abs(len(quads.data.polygons) - len(before[0]) / 2) < 0.15 * len(before[0])
    assert quads.matrix_world == reference.matrix_world
    settings = one_mesh.refmesh.settings
    assert settings.mesh_frame == OVER_REFERENCE and settings.mesh == str(tmp_path / "out" / "own_mesh.ply")
    surface = TriangleMesh(np.array(before[1]), np.array(before[0]))
    distances = SurfaceIndex(surface).query(read_mesh(tmp_path / "out" / "own_mesh.ply").vertices).distances
    assert distances.max() < 0.03 * surface.diagonal
    run(one_mesh, tmp_path / "out", **ONE_MESH)
    assert polygons(one_mesh.refmesh.groups[0].deformed.data) == polygons(quads.data)


@pytest.mark.parametrize("operator", ["use_own_mesh", "remesh_to_quads"])
def test_results_about_another_offset_are_written_where_the_frames_are(blender, one_mesh, tmp_path, operator):
    reference = one_mesh.refmesh.groups[0].reference
    one_mesh.refmesh.root[RESULTS_OFFSET] = (offset_of(one_mesh.refmesh.root) + [100.0, 0.0, -50.0]).tolist()
    blender.context.view_layer.objects.active = reference
    getattr(blender.ops.refmesh, operator)()
    expected, written = read_positions(reference.data) + [100.0, 0.0, -50.0], read_mesh(tmp_path / "out" / "own_mesh.ply").vertices
    bounds = [(places.min(axis=0), places.max(axis=0)) for places in (expected, written)]
    np.testing.assert_allclose(*bounds, atol=0.25)  # quads of this size round the poles off


def test_quadriflow_takes_the_number_of_faces(blender, one_mesh):
    counts = []
    for faces in (60, 240):
        before = set(bpy.data.objects)
        blender.ops.refmesh.remesh_to_quads(faces=faces)
        (quads,) = set(bpy.data.objects) - before
        counts.append(len(quads.data.polygons))
    assert 2 * counts[0] < counts[1] < 480


def test_what_quadriflow_cannot_remesh_is_refused_and_leaves_nothing_behind(blender, one_mesh):
    one_mesh.refmesh.groups[0].reference.data.polygons[0].flip()
    before = set(bpy.data.objects), set(bpy.data.meshes), one_mesh.refmesh.settings.mesh
    with pytest.raises(RuntimeError, match="not manifold or has faces that point in inconsistent directions.*by hand"):
        blender.ops.refmesh.remesh_to_quads()
    assert (set(bpy.data.objects), set(bpy.data.meshes), one_mesh.refmesh.settings.mesh) == before


def test_quads_need_one_reference_mesh_for_the_take(blender, solved):
    with pytest.raises(RuntimeError, match="has 2 reference meshes.*serves the whole take"):
        blender.ops.refmesh.remesh_to_quads()
    solved.refmesh.groups.clear()
    with pytest.raises(RuntimeError, match="no reference mesh yet; run the Reference step"):
        blender.ops.refmesh.remesh_to_quads()


def test_reconstructed_meshes_come_back_when_it_is_forgotten(blender, ball, quads, tmp_path):
    ball.refmesh.output = str(tmp_path / "out")
    blender.ops.refmesh.use_own_mesh()
    run(ball, tmp_path / "out")
    blender.ops.refmesh.forget_own_mesh()
    run(ball, tmp_path / "out")
    assert len(ball.refmesh.groups) == 2
    assert {len(polygon.vertices) for polygon in ball.refmesh.groups[0].deformed.data.polygons} == {3}
    assert "Top" in ball.refmesh.groups[0].deformed.vertex_groups


def test_a_file_on_the_command_line_keeps_its_polygons(blender, ball, quads, tmp_path):
    path, quads.matrix_world = tmp_path / "head.obj", Matrix.Scale(2.0, 4)  # a file is in the coordinates of the frames
    blender.ops.wm.obj_export(filepath=str(path), export_selected_objects=True, forward_axis="Y", up_axis="Z", export_materials=False)
    expected = polygons(quads.data)
    bpy.data.objects.remove(quads)
    blender.context.view_layer.objects.active = ball
    blender.ops.refmesh.run_all(output=str(tmp_path / "out"), quiet=True, **TINY, mesh=str(path), mesh_frame=FRAME)
    assert polygons(ball.refmesh.groups[0].deformed.data) == expected
    assert blender.context.active_object == ball


def test_what_has_no_faces_or_is_no_mesh_is_refused(blender, ball, tmp_path):
    blender.ops.mesh.primitive_uv_sphere_add()
    empty = blender.context.active_object
    empty.data.clear_geometry()
    with pytest.raises(RuntimeError, match="has no faces"):
        blender.ops.refmesh.use_own_mesh()
    blender.context.view_layer.objects.active = ball
    with pytest.raises(RuntimeError, match="select the mesh"):
        blender.ops.refmesh.use_own_mesh()
    with pytest.raises(RuntimeError, match="no mesh of your own"):
        blender.ops.refmesh.forget_own_mesh()


def unplaced(vertices: np.ndarray, number: int) -> np.ndarray:
    """Undoes `place`."""
    return (vertices - [0.1 * number, 2.0, 0.0]) / [1.0, 1.5 + 0.1 * number, 0.8]
