"""Whatever a person adds to a result or a reference object stays, whichever operator runs."""

from __future__ import annotations

import json

import bpy
import numpy as np
import pytest

from refmesh_addon.bridge.results.heat_map import MATERIAL_NAME
from refmesh_addon.bridge.scene.attributes import read_weights
from refmesh_addon.bridge.scene.meshes import read_positions
from refmesh_addon.core.errors import RefMeshError

from .artist_work import dress, snapshot
from .conftest import GROUPS, place, reference, write_results
from .test_view import rendered_materials


@pytest.fixture
def dressed(solved):
    """The loaded sequence, with work on every reference and deformed object."""
    for member in members(solved):
        dress(member)
    return solved


def members(owner) -> list[bpy.types.Object]:
    return [member for group in owner.refmesh.groups for member in (group.reference, group.deformed)]


def work(owner) -> dict:
    return {member.name: snapshot(member) for member in members(owner)}


def check_same(before: dict, after: dict) -> None:
    for name, expected in before.items():
        for part in expected:
            assert after[name][part] == expected[part], f"{part} of {name}"


def show_and_hide_errors(ops, owner):
    owner.refmesh.heat_map = True
    bpy.context.scene.frame_set(10)
    bpy.context.scene.frame_set(7)
    owner.refmesh.heat_map = False


def switch_everything(ops, owner):
    for kind in ("source", "centers", "reference", "result"):
        setattr(owner.refmesh, f"show_{kind}", False)
        setattr(owner.refmesh, f"show_{kind}", True)


def mark(ops, owner):
    owner.refmesh.centers.data.vertices.foreach_set("select", np.arange(len(owner.refmesh.centers.data.vertices)) < 5)
    ops.mark_body()


ACTIONS = {
    "load_results": lambda ops, owner: ops.load_results(),
    "errors": show_and_hide_errors,
    "switches": switch_everything,
    "evaluate": lambda ops, owner: ops.evaluate(),
    "exclude_frame": lambda ops, owner: ops.exclude_frame(),
    "edit_groups": lambda ops, owner: ops.edit_groups(change="SPLIT"),
    "bodies": mark,
    "trails": lambda ops, owner: [ops.show_trails(), ops.remove_trails()],
    "preset": lambda ops, owner: ops.apply_preset(preset="draft"),
    "set_timeline": lambda ops, owner: ops.set_timeline(),
    "go_to_frame": lambda ops, owner: ops.go_to_frame(frame="10"),
    "check_sequence": lambda ops, owner: ops.check_sequence(),
    "export_glb": lambda ops, owner: ops.export(format="glb"),
    "export_ply": lambda ops, owner: ops.export(format="ply"),
    "export_pc2": lambda ops, owner: ops.export(format="pc2"),
    "preview": lambda ops, owner: ops.render_preview(filepath=bpy.path.abspath(owner.refmesh.output) + "/preview.png", width=64),
    "save_scene": lambda ops, owner: ops.save_scene(filepath=bpy.path.abspath(owner.refmesh.output) + "/scene.blend"),
}
if bpy.app.build_options.alembic:
    ACTIONS["export_abc"] = lambda ops, owner: ops.export(format="abc")
if bpy.app.build_options.usd:
    ACTIONS["export_usd"] = lambda ops, owner: ops.export(format="usd")


@pytest.mark.parametrize("action", ACTIONS)
def test_work_stays_whatever_runs(blender, dressed, action):
    before = work(dressed)
    ACTIONS[action](blender.ops.refmesh, dressed)
    after = work(dressed)
    if action == "save_scene":  # paths become relative
        for parts in (*before.values(), *after.values()):
            for modifier in parts["modifiers"]:
                modifier.pop("filepath", None)
    check_same(before, after)


def test_a_moved_reference_mesh_takes_edits_and_shape_keys_along(blender, dressed, results):
    """The same topology elsewhere: all offsets that a person made stay."""
    deformed = dressed.refmesh.groups[0].deformed
    rest = reference(0).vertices
    edited = read_positions(deformed.data)
    edited[3] += [0.0, 0.0, 0.5]
    deformed.data.attributes["position"].data.foreach_set("vector", edited.ravel())
    before = snapshot(deformed)
    move_reference(results, 0, lambda vertices: vertices + [1.0, 0.0, 0.0])
    blender.ops.refmesh.load_results()
    moved = read_positions(deformed.data) - rest
    np.testing.assert_allclose(moved[3], [1.0, 0.0, 0.5], atol=1e-6)
    np.testing.assert_allclose(np.delete(moved, 3, axis=0), np.tile([1.0, 0.0, 0.0], (len(rest) - 1, 1)), atol=1e-6)
    after = snapshot(deformed)
    for part in before.keys() - {"positions", "keys", "modifiers"}:
        assert after[part] == before[part], part
    smile = np.array([point.co for point in deformed.data.shape_keys.key_blocks["smile"].data])
    np.testing.assert_allclose(smile, rest + [1.0, 0.125, 0.0], atol=1e-6)


def move_reference(out, index: int, change) -> None:
    from refmesh_addon.io.meshes import read_mesh
    from refmesh_addon.io.ply import write_ply

    path = out / "reference" / f"group_{index:03d}.ply"
    mesh = read_mesh(path)
    write_ply(path, mesh.moved(change(mesh.vertices)))


def test_another_topology_takes_everything_over_by_nearest_surface(blender, dressed, frames, tmp_path, monkeypatch):
    """A finer sphere in place of the first: linear values arrive as they were, up to the distance of the two surfaces."""
    from . import conftest

    deformed = dressed.refmesh.groups[0].deformed
    modifiers = [modifier.name for modifier in deformed.modifiers]
    finer = reference(2)
    monkeypatch.setattr(conftest, "reference", lambda index: finer)
    out = write_results(tmp_path / "finer", frames)
    blender.ops.refmesh.load_results(output=str(out))
    mesh, vertices = deformed.data, finer.vertices
    assert len(mesh.vertices) == len(vertices) and [modifier.name for modifier in deformed.modifiers] == modifiers
    corners = np.array([loop.vertex_index for loop in mesh.loops])
    for name, axes in (("UVMap", [0, 1]), ("Light", [1, 2])):
        uv = np.empty(2 * len(corners), dtype=np.float32)
        mesh.uv_layers[name].uv.foreach_get("vector", uv)
        np.testing.assert_allclose(uv.reshape(-1, 2), vertices[corners][:, axes], atol=0.12)
    assert mesh.uv_layers.active.name == "Light" and mesh.uv_layers["Light"].active_render
    weights = read_weights(deformed)
    np.testing.assert_allclose(np.nan_to_num(weights[:, 0]), np.clip(vertices[:, 1], 0, 1), atol=0.2)
    np.testing.assert_allclose(weights[:, 1], 1.0, atol=1e-6)
    assert [group.name for group in deformed.vertex_groups] == ["head", "all"]
    assert mesh.color_attributes.active_color_name == "Paint" and "label" in mesh.attributes
    assert {face.material_index for face in mesh.polygons} == {1, 2} and len(deformed.material_slots) == 3
    smile = mesh.shape_keys.key_blocks["smile"]
    np.testing.assert_allclose([point.co for point in smile.data], vertices + [0, 0.125, 0], atol=1e-6)
    assert (smile.value, smile.vertex_group) == (0.5, "head") and mesh.shape_keys.animation_data.action


def test_another_topology_is_reported_with_what_was_carried(blender, dressed, frames, tmp_path, monkeypatch, capfd):
    from . import conftest

    monkeypatch.setattr(conftest, "reference", lambda index: reference(2))
    blender.ops.refmesh.load_results(output=str(write_results(tmp_path / "finer", frames)))
    message = capfd.readouterr().out
    kinds = "UV maps, color attributes, other attributes, material assignment, vertex groups, shape keys"
    assert f"the topology has changed; carried over by nearest surface: {kinds} of groups 0-1" in message


def test_errors_leave_the_colors_that_a_person_painted(blender, dressed):
    deformed = dressed.refmesh.groups[0].deformed
    blender.context.scene.frame_set(7)
    dressed.refmesh.heat_map = True
    assert rendered_materials(deformed) == {MATERIAL_NAME}
    assert deformed.data.color_attributes.active_color_name == "RefMesh Error" and "Paint" in deformed.data.color_attributes
    blender.ops.refmesh.load_results()  # also while they are shown
    assert dressed.refmesh.heat_map
    dressed.refmesh.heat_map = False
    assert deformed.data.color_attributes.active_color_name == "Paint" and "RefMesh Error" not in deformed.data.attributes


def test_loading_the_same_results_touches_nothing(blender, dressed):
    """Blender marks what is written; nothing that the results show is."""
    touched = []

    def note(scene, depsgraph):
        touched.extend(update.id.name for update in depsgraph.updates if update.is_updated_geometry)

    bpy.context.view_layer.update()
    bpy.app.handlers.depsgraph_update_post.append(note)
    try:
        blender.ops.refmesh.load_results()
        bpy.context.view_layer.update()
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(note)
    assert not set(touched) & {name for member in members(dressed) for name in (member.name, member.data.name)}


def test_groups_play_after_everything(blender, dressed):
    """The cache still comes first, below the modifiers of the person."""
    for modifier in list(dressed.refmesh.groups[0].deformed.modifiers)[1:]:
        dressed.refmesh.groups[0].deformed.modifiers.remove(modifier)
    dressed.refmesh.groups[0].deformed.location = (0, 0, 0)
    blender.ops.refmesh.load_results()
    for number in GROUPS[0]:
        blender.context.scene.frame_set(number)
        shown = dressed.refmesh.groups[0].deformed.evaluated_get(blender.context.evaluated_depsgraph_get()).data
        np.testing.assert_array_equal(read_positions(shown), place(reference(0).vertices, number).astype(np.float32))


def test_nothing_runs_while_all_is_up_to_date(blender, dressed, results, frames, monkeypatch):
    from refmesh_addon.pipeline.process import client

    started = []

    def start(spec, **options):
        started.append(spec)
        raise RefMeshError("a worker was started")

    monkeypatch.setattr(client, "WorkerProcess", start)
    for operator in ("track", "extract_reference", "deform", "evaluate"):
        assert getattr(blender.ops.refmesh, operator)() == {"FINISHED"} and not started
    for change in (
        lambda: blender.ops.refmesh.evaluate(centers=123),
        lambda: blender.ops.refmesh.evaluate(resume=False),
        lambda: blender.ops.refmesh.evaluate(frames="6-8"),
        lambda: [(frames / "ball_0007.obj").touch(), blender.ops.refmesh.evaluate()],
    ):
        with pytest.raises(RuntimeError, match="a worker was started"):
            change()


def test_a_report_of_other_settings_changes_nothing_on_the_objects(blender, dressed, results):
    before = work(dressed)
    report = json.loads((results / "report.json").read_text())
    report["settings"]["centers"] = 777
    (results / "report.json").write_text(json.dumps(report))
    blender.ops.refmesh.load_results()
    assert dressed.refmesh.settings.centers == 777
    check_same(before, work(dressed))


def test_work_waits_for_the_next_results_where_a_step_leaves_none(blender, dressed, results):
    """Running Reference alone removes the deformed meshes; what is on them comes back with the next ones."""
    whole, before = (results / "report.json").read_text(), work(dressed)
    report = json.loads(whole)
    report["frames"] = []
    for group in report["groups"]:
        group.pop("playback")
    (results / "report.json").write_text(json.dumps(report))
    blender.ops.refmesh.load_results()
    assert not any(group.deformed for group in dressed.refmesh.groups)
    (results / "report.json").write_text(whole)
    blender.ops.refmesh.load_results()
    check_same(before, work(dressed))
    assert not dressed.refmesh.groups[0].deformed.users_collection[0].hide_viewport


def test_a_group_that_is_no_more_leaves_the_work_that_was_on_it(blender, dressed, results):
    last = dressed.refmesh.groups[1].deformed
    report = json.loads((results / "report.json").read_text())
    report["groups"].pop()
    (results / "report.json").write_text(json.dumps(report))
    blender.ops.refmesh.load_results()
    assert len(dressed.refmesh.groups) == 1 and "UVMap" in last.data.uv_layers and last.users_collection[0].hide_render
