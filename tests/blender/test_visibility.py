"""The modifier that hides what a frame does not show: it plays with the scene, with or without the add-on."""

import json

import bpy
import numpy as np
import pytest

import refmesh_addon
from refmesh_addon.bridge.results.groups import has_work
from refmesh_addon.bridge.scene.visibility_nodes import ATTRIBUTE, HIDE, NAME
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


def test_glb_keeps_its_morph_targets(blender, open_take, results):
    blender.ops.refmesh.export(format="glb")
    assert any((results / "export").glob("*.glb"))
