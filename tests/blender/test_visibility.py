"""The modifier that hides what a frame does not show: it plays with the scene, with or without the add-on."""

import json

import bpy
import numpy as np
import pytest

import refmesh_addon
from refmesh_addon.bridge.results.groups import has_work
from refmesh_addon.bridge.scene.visibility_nodes import ATTRIBUTE, FADE, HIDE, NAME, TRANSPARENCY
from refmesh_addon.io.ply import read_surface, read_velocities, write_ply
from refmesh_addon.io.visibility_sheet import write_visibility

from .conftest import GROUPS, NUMBERS, reference


def values(index: int, number: int) -> np.ndarray:
    """Visibility of the vertices of a group in a frame: other vertices are hidden in each frame."""
    return np.clip(0.5 + reference(index).vertices[:, number % 3], 0.0, 1.0)


def add_sheets(results, suffix="0"):
    """Makes the results those of an open take."""
    report = json.loads((results / "report.json").read_text(encoding="utf-8"))
    for index, numbers in enumerate(GROUPS):
        picture = f"playback/visibility_{index:03d}-{suffix}.png"
        last = GROUPS[index + 1][0] if index + 1 < len(GROUPS) else NUMBERS[-1] + 1
        shown = [max(number for number in numbers if number <= frame) for frame in range(numbers[0], last)]
        count = len(reference(index).vertices)
        write_visibility(results / picture, (values(index, number) for number in shown), count, len(shown))
        report["groups"][index]["visibility"] = picture
    for frame in report["frames"]:
        path = results / frame["deformed"]
        visibility = values(frame["group"], frame["number"])
        write_ply(path, read_surface(path), velocities=read_velocities(path), visibility=visibility)
    (results / "report.json").write_text(json.dumps(report), encoding="utf-8")


def evaluated(member, scene_frame):
    """The mesh of an object as it is shown in a scene frame: its positions and visibility."""
    bpy.context.scene.frame_set(scene_frame)
    mesh = member.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    positions, visibility = np.empty(3 * len(mesh.vertices), np.float32), np.empty(len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", positions)
    mesh.attributes[ATTRIBUTE].data.foreach_get("value", visibility)
    return positions.reshape(-1, 3), visibility


@pytest.fixture
def open_take(blender, ball, results):
    """The sequence object with results of an open take."""
    add_sheets(results)
    blender.ops.refmesh.load_results(output=str(results))
    return ball


def set_input(modifier, name, value):
    item = next(item for item in modifier.node_group.interface.items_tree if item.name == name)
    modifier[item.identifier] = value
    modifier.node_group.interface_update(bpy.context)
    modifier.id_data.update_tag()


def test_each_frame_hides_what_it_does_not_show(open_take):
    starts = {int(frame.name): frame.scene_frame for frame in open_take.refmesh.frames}
    for index, numbers in enumerate(GROUPS):
        member = open_take.refmesh.groups[index].deformed
        for number in numbers:
            expected = values(index, number)
            positions, visibility = evaluated(member, starts[number])
            clear = np.abs(expected - 0.5) > 1 / 255
            assert abs(len(positions) - (expected > 0.5).sum()) <= (~clear).sum()
            assert visibility.min() > 0.49


def test_the_attribute_is_there_for_materials_where_nothing_is_hidden_and_without_the_add_on(open_take):
    member, numbers = open_take.refmesh.groups[1].deformed, GROUPS[1]
    starts = {int(frame.name): frame.scene_frame for frame in open_take.refmesh.frames}
    set_input(member.modifiers[NAME], HIDE, False)
    refmesh_addon.unregister()
    try:
        for number in numbers:
            _, visibility = evaluated(member, starts[number])
            np.testing.assert_allclose(visibility, values(1, number), atol=0.51 / 255)
    finally:
        refmesh_addon.register()


def test_the_surface_fades_towards_what_is_hidden_or_wherever_it_is_not_shown(open_take):
    member, number = open_take.refmesh.groups[1].deformed, GROUPS[1][0]
    frame = next(frame.scene_frame for frame in open_take.refmesh.frames if frame.name == str(number))
    _, visibility = evaluated(member, frame)
    np.testing.assert_allclose(layer(member, TRANSPARENCY), 2 - 2 * visibility, atol=1e-6)
    set_input(member.modifiers[NAME], HIDE, False)
    _, visibility = evaluated(member, frame)
    np.testing.assert_allclose(layer(member, TRANSPARENCY), 1 - visibility, atol=1e-6)
    set_input(member.modifiers[NAME], FADE, False)
    evaluated(member, frame)
    assert layer(member, TRANSPARENCY) is None
    alpha = next(node for node in member.active_material.node_tree.nodes if node.type == "BSDF_PRINCIPLED").inputs["Alpha"]
    assert alpha.links[0].from_node.inputs[1].links[0].from_node.attribute_name == TRANSPARENCY


def layer(member, name):
    """An attribute of the points of an object as it is shown; None where it has none."""
    attribute = member.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.attributes.get(name)
    return None if attribute is None else np.array([item.value for item in attribute.data])


def test_new_results_replace_the_picture_and_closed_ones_remove_the_modifier(blender, open_take, results):
    member = open_take.refmesh.groups[0].deformed
    assert not has_work(member)
    add_sheets(results, suffix="1")
    blender.ops.refmesh.load_results(output=str(results))
    images = [image.name for image in bpy.data.images if image.name.startswith("visibility")]
    assert sorted(images) == ["visibility_000-1.png", "visibility_001-1.png"]
    assert all(bpy.data.images[name].packed_file for name in images)
    report = json.loads((results / "report.json").read_text(encoding="utf-8"))
    for group in report["groups"]:
        del group["visibility"]
    (results / "report.json").write_text(json.dumps(report), encoding="utf-8")
    blender.ops.refmesh.load_results(output=str(results))
    assert NAME not in member.modifiers


def test_a_missing_picture_is_named(blender, ball, results):
    add_sheets(results)
    (results / "playback" / "visibility_001-0.png").unlink()
    with pytest.raises(RuntimeError, match="visibility_001-0.png"):
        blender.ops.refmesh.load_results(output=str(results))


@pytest.mark.skipif(not bpy.app.build_options.usd, reason="this Blender has no USD")
def test_usd_has_the_visibility_of_each_point_and_all_points_of_each_frame(blender, open_take, results):
    blender.ops.refmesh.export(format="usd")
    (path,) = (results / "export").glob("*.usd*")
    number, index = GROUPS[1][-1], 1
    frame = next(frame.scene_frame for frame in open_take.refmesh.frames if frame.name == str(number))
    before = set(bpy.data.objects)
    blender.ops.wm.usd_import(filepath=str(path))
    blender.context.scene.frame_set(frame)
    count = len(reference(index).vertices)
    meshes = [one for one in set(bpy.data.objects) - before if one.type == "MESH" and len(one.data.vertices) == count]
    mesh = meshes[0].evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    visibility = np.empty(count, np.float32)
    mesh.attributes[ATTRIBUTE].data.foreach_get("value", visibility)
    np.testing.assert_allclose(visibility, values(index, number), atol=0.51 / 255)


@pytest.mark.skipif(not bpy.app.build_options.alembic, reason="this Blender has no Alembic")
def test_alembic_has_the_visibility_of_each_frame_as_a_color(blender, open_take, results):
    blender.ops.refmesh.export(format="abc")
    (path,) = (results / "export").glob("*.abc")
    before, count = set(bpy.data.objects), len(reference(1).vertices)
    blender.ops.wm.alembic_import(filepath=str(path), as_background_job=False)
    meshes = [one for one in set(bpy.data.objects) - before if one.type == "MESH" and len(one.data.vertices) == count]
    for number in GROUPS[1]:
        blender.context.scene.frame_set(next(frame.scene_frame for frame in open_take.refmesh.frames if frame.name == str(number)))
        mesh = meshes[0].evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        gray = np.array([corner.color[0] for corner in mesh.color_attributes[ATTRIBUTE].data])
        corners = np.array([loop.vertex_index for loop in mesh.loops])
        np.testing.assert_allclose(gray, values(1, number)[corners], atol=0.01)


def test_glb_keeps_its_morph_targets_and_has_the_mean_visibility(blender, open_take, results):
    blender.ops.refmesh.export(format="glb")
    (path,) = (results / "export").glob("*.glb")
    header = path.read_bytes()[20:]
    document = json.JSONDecoder().raw_decode(header.decode("utf-8", "replace"))[0]
    primitives = [mesh["primitives"][0] for mesh in document["meshes"]]
    assert all("_VISIBILITY" in primitive["attributes"] and primitive["targets"] for primitive in primitives if "targets" in primitive)
    assert any("targets" in primitive for primitive in primitives)
    count = document["accessors"][primitives[-1]["attributes"]["_VISIBILITY"]]["count"]
    assert count >= len(reference(len(primitives) - 1).vertices)
