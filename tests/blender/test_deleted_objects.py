"""Objects of a sequence that a person deletes, or takes the playback from, come back with the next run or Load Results."""

import bpy
import pytest

from .test_bad_places import refused


def delete(member: bpy.types.Object) -> None:
    """As the X key does."""
    for other in bpy.context.selected_objects:
        other.select_set(False)
    member.hide_set(False)
    for collection in member.users_collection:
        collection.hide_viewport = False
    bpy.context.view_layer.objects.active = member
    member.select_set(True)
    assert bpy.ops.object.delete() == {"FINISHED"} and not member.users_collection


def objects_of(owner: bpy.types.Object) -> dict[str, bpy.types.Object]:
    state, group = owner.refmesh, owner.refmesh.groups[0]
    return {"source": owner, "root": state.root, "centers": state.centers, "reference": group.reference, "result": group.deformed}


@pytest.mark.parametrize("kind", ["source", "root", "centers", "reference", "result"])
def test_what_was_deleted_comes_back_where_it_was(blender, solved, capfd, kind):
    member = objects_of(solved)[kind]
    before = {other: (tuple(other.users_collection), other.parent) for other in bpy.context.scene.objects}
    delete(member)
    bpy.context.view_layer.objects.active = objects_of(solved)["centers" if kind == "result" else "result"]
    assert blender.ops.refmesh.load_results() == {"FINISHED"}
    assert f"deleted objects are back: {member.name}" in capfd.readouterr().out
    assert {other: (tuple(other.users_collection), other.parent) for other in bpy.context.scene.objects} == before


def test_a_root_that_a_script_removed_is_made_anew(blender, solved):
    bpy.data.objects.remove(solved.refmesh.root)
    bpy.context.view_layer.objects.active = solved
    blender.ops.refmesh.load_results()
    root = solved.refmesh.root
    assert root.refmesh.sequence == solved and all(member.parent == root for kind, member in objects_of(solved).items() if kind != "root")


def test_other_operators_say_how_a_deleted_source_comes_back(blender, solved):
    deformed = solved.refmesh.groups[0].deformed
    delete(solved)
    bpy.context.view_layer.objects.active = deformed
    for operator in ("reload_frames", "set_timeline", "scale_sequence"):
        refused(operator, "the source was deleted: press 'Load Results'")


def subdivide(member: bpy.types.Object) -> None:
    bpy.context.view_layer.objects.active = member
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide()
    bpy.ops.object.mode_set(mode="OBJECT")


def convert(member: bpy.types.Object) -> None:
    """Applies the modifiers."""
    bpy.context.view_layer.objects.active = member
    member.select_set(True)
    bpy.ops.object.convert(target="MESH")


@pytest.mark.parametrize("change", [subdivide, convert])
def test_a_mesh_that_no_longer_plays_is_not_exported_and_comes_back(blender, solved, change):
    deformed = solved.refmesh.groups[0].deformed
    vertices = len(deformed.data.vertices)
    change(deformed)
    for kind in ("pc2", "ply", "glb"):
        refused("export", "its mesh is no longer that of its point cache", format=kind)
    blender.ops.refmesh.load_results()
    assert len(deformed.data.vertices) == vertices and blender.ops.refmesh.export(format="glb") == {"FINISHED"}
