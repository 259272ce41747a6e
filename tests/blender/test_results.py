"""Results in the output folder become objects that play."""

from __future__ import annotations

import json

import bpy
import numpy as np
import pytest

from refmesh_addon.bridge.results.center_colors import colors_by_place
from refmesh_addon.bridge.results.centers import spacing
from refmesh_addon.bridge.scene.meshes import read_positions

from .conftest import CENTERS, GROUPS, NUMBERS, place, reference


def evaluated(member) -> np.ndarray:
    return read_positions(member.evaluated_get(bpy.context.evaluated_depsgraph_get()).data)


def group_of(number: int) -> int:
    return next(index for index, numbers in enumerate(GROUPS) if number in numbers)


def test_deformed_mesh_plays_every_frame(solved):
    for number in NUMBERS:
        bpy.context.scene.frame_set(number)
        deformed = solved.refmesh.groups[group_of(number)].deformed
        expected = place(reference(group_of(number)).vertices, number)
        np.testing.assert_array_equal(evaluated(deformed), expected.astype(np.float32))


@pytest.mark.parametrize("scene_frame, index", [(1, 0), (6, 0), (8, 0), (9, 0), (10, 1), (11, 1), (50, 1)])
def test_exactly_one_group_is_visible(solved, scene_frame, index):
    bpy.context.scene.frame_set(scene_frame)
    for place_in_row, group in enumerate(solved.refmesh.groups):
        for member in (group.reference, group.deformed):
            hidden = place_in_row != index
            assert (member.hide_viewport, member.hide_render) == (hidden, hidden)


def test_a_missing_number_holds_the_one_before(solved):
    bpy.context.scene.frame_set(8)
    before = evaluated(solved.refmesh.groups[0].deformed)
    bpy.context.scene.frame_set(9)
    np.testing.assert_array_equal(evaluated(solved.refmesh.groups[0].deformed), before)


def test_bodies_and_bad_frames_of_the_report_reach_the_panel(blender, ball, results):
    path = results / "report.json"
    report = json.loads(path.read_text())
    alone = {"centers": 20, "position": [0.0, 0.0, 0.0]}
    report["bodies"] = [alone | {"frames": [8, 8], "by_motion": False}, alone | {"frames": [6, 10], "by_motion": True}]
    bad = {"frame": 8, "reason": "5% of the surface is missing", "position": [0.0, 0.0, 0.0], "before": 6, "after": 10}
    report["bad_frames"] = [bad | {"bridged": True}]
    path.write_text(json.dumps(report))
    blender.ops.refmesh.load_results(output=str(results))
    assert ball.refmesh.bodies.splitlines() == [
        "Body 1: 20 centers, widest gap in frame 8",
        "Body 2: 20 centers, moves apart in frames 6-10",
    ]
    assert {frame.name: frame.bad for frame in ball.refmesh.frames if frame.bad} == {
        "8": "5% of the surface is missing; moves from 6 to 10"
    }


def test_centers_are_spheres_that_follow_their_cache_and_keep_their_colors(solved, results):
    positions = np.load(results / "centers.npz")["positions"]
    solved.refmesh.show_centers = True
    for row, number in enumerate(NUMBERS):
        bpy.context.scene.frame_set(number)
        mesh = solved.refmesh.centers.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        spheres = read_positions(mesh)[CENTERS:].reshape(CENTERS, -1, 3)  # after the vertices themselves
        np.testing.assert_allclose(spheres.mean(axis=1), positions[row], atol=1e-5)
        assert mesh.color_attributes.active_color_name == "Col"
        colors = np.empty(4 * len(mesh.vertices), dtype=np.float32)
        mesh.attributes["Col"].data.foreach_get("color", colors)
        colors = colors.reshape(-1, 4)
        np.testing.assert_allclose(colors[CENTERS:].reshape(CENTERS, -1, 4), np.broadcast_to(colors[:CENTERS, None], (CENTERS, 42, 4)))


def test_the_group_of_the_current_frame_is_seen_at_once(blender, ball, results):
    blender.context.scene.frame_set(7)
    blender.ops.refmesh.load_results(output=str(results))
    assert [(group.deformed.hide_viewport, group.reference.hide_render) for group in ball.refmesh.groups] == [(False, False), (True, True)]


def test_the_result_is_seen_in_place_of_the_source(solved):
    """Seen is what renders too; every kind has a collection and a switch of its own."""
    state = solved.refmesh
    kinds = {"source": solved, "centers": state.centers, "reference": state.groups[0].reference, "result": state.groups[0].deformed}
    collections = {kind: member.users_collection[0] for kind, member in kinds.items()}
    assert [kind for kind in kinds if not collections[kind].hide_viewport] == ["result"]
    assert len(set(collections.values())) == 4 and all(member.location.length == 0 for member in kinds.values())
    for shown in (kinds, ["result"], ["source", "centers"], ["reference"], []):
        for kind in kinds:
            setattr(state, f"show_{kind}", kind in shown)
        hidden = {kind: (collection.hide_viewport, collection.hide_render) for kind, collection in collections.items()}
        assert hidden == {kind: (kind not in shown, kind not in shown) for kind in kinds}


def test_each_step_shows_what_it_adds_and_then_leaves_the_switches_alone(blender, ball, results):
    whole = (results / "report.json").read_text()
    for change, shown in (
        (lambda report: report.update(groups=[], frames=[]), {"source", "centers"}),
        (lambda report: [report.update(frames=[])] + [group.pop("playback") for group in report["groups"]], {"reference"}),
        (lambda report: None, {"result"}),
    ):
        (results / "report.json").write_text(whole)
        edit_report(results, change)
        blender.ops.refmesh.load_results(output=str(results))
        assert {kind for kind in ("source", "centers", "reference", "result") if getattr(ball.refmesh, f"show_{kind}")} == shown
    ball.refmesh.show_source = True
    blender.ops.refmesh.load_results(output=str(results))
    assert ball.refmesh.show_source and ball.refmesh.show_result and not ball.refmesh.show_centers


def test_source_centers_reference_and_result_stand_side_by_side(solved):
    solved.refmesh.arrangement = "SIDE"
    bpy.context.scene.frame_set(6)
    bpy.context.view_layer.update()
    group = solved.refmesh.groups[0]
    spans = []
    columns = [member.location.x for member in (solved, solved.refmesh.centers, group.reference, group.deformed)]
    assert columns[0] == 0 and columns[1] > 0 and columns[2:] == pytest.approx([2 * columns[1], 3 * columns[1]])
    for member in (solved, group.reference, group.deformed):
        across = (evaluated(member) @ np.array(member.matrix_world.to_3x3()).T)[:, 0] + member.matrix_world.translation.x
        spans.append((across.min(), across.max()))
    assert spans[0][1] < spans[1][0] and spans[1][1] < spans[2][0]


def test_one_switch_lays_everything_in_one_place(solved):
    group = solved.refmesh.groups[0]
    assert group.reference.location.x == group.deformed.location.x == solved.refmesh.centers.location.x == 0
    solved.refmesh.arrangement = "SIDE"
    assert 0 < solved.refmesh.centers.location.x < group.reference.location.x < group.deformed.location.x
    assert all(getattr(solved.refmesh, f"show_{kind}") for kind in ("source", "centers", "reference", "result"))
    solved.refmesh.arrangement = "OVERLAY"
    assert group.deformed.location.x == 0 and not solved.refmesh.show_source


def test_groups_are_named_markers_that_are_kept_up_to_date(blender, solved, results):
    markers = blender.context.scene.timeline_markers
    markers.new("my own", frame=6)
    assert [(marker.name, marker.frame) for marker in markers] == [("ball 6-8", 6), ("ball 10-11", 10), ("my own", 6)]
    markers["ball 10-11"].name = "landing"
    solved.refmesh.root.name = "hero"
    blender.ops.refmesh.load_results()
    assert sorted((marker.name, marker.frame) for marker in markers) == [("hero 6-8", 6), ("landing", 10), ("my own", 6)]
    edit_report(results, lambda report: report["groups"].pop())
    blender.ops.refmesh.load_results()
    assert sorted(marker.name for marker in markers) == ["hero 6-8", "my own"]


def test_loading_again_refreshes_what_is_there(blender, solved, results):
    before = {kind: len(getattr(bpy.data, kind)) for kind in ("objects", "meshes", "materials", "actions", "node_groups", "collections")}
    solved.refmesh.groups[0].deformed.name = "my name"
    blender.ops.refmesh.load_results()
    assert {kind: len(getattr(bpy.data, kind)) for kind in before} == before
    assert solved.refmesh.groups[0].deformed.name == "my name"


def test_groups_that_are_no_more_go(blender, solved, results):
    edit_report(results, lambda report: report["groups"].pop())
    blender.ops.refmesh.load_results()
    assert len(solved.refmesh.groups) == 1 and "ball reference 001" not in bpy.data.objects


def test_state_follows_the_report(blender, ball, results):
    whole = (results / "report.json").read_text()
    for stage, change in [
        ({"tracking"}, lambda report: report.update(groups=[], frames=[])),
        ({"tracking", "reference"}, lambda report: [report.update(frames=[])] + [group.pop("playback") for group in report["groups"]]),
        ({"tracking", "reference", "deformation"}, lambda report: [frame.pop("source_to_deformed") for frame in report["frames"]]),
        ({"tracking", "reference", "deformation", "evaluation"}, lambda report: None),
    ]:
        (results / "report.json").write_text(whole)
        edit_report(results, change)
        blender.ops.refmesh.load_results(output=str(results))
        assert ball.refmesh.done == stage
        assert all(bool(group.deformed) == ("deformation" in stage) for group in ball.refmesh.groups)


def test_distances_of_frames_are_kept(solved):
    assert [frame.distance for frame in solved.refmesh.frames] == pytest.approx([0.001 * number for number in NUMBERS])


def test_over_stretched_shares_of_frames_are_kept_where_the_report_has_them(blender, ball, results):
    shares = [0.002 * number for number in NUMBERS]
    edit_report(results, lambda report: [frame.update(overstretched=share) for frame, share in zip(report["frames"], shares)])
    blender.ops.refmesh.load_results(output=str(results))
    assert [frame.overstretched for frame in ball.refmesh.frames] == pytest.approx(shares)
    edit_report(results, lambda report: [frame.pop("overstretched") for frame in report["frames"]])
    blender.ops.refmesh.load_results(output=str(results))
    assert {frame.overstretched for frame in ball.refmesh.frames} == {0.0}


@pytest.mark.parametrize(
    "damage, message",
    [
        (lambda out: (out / "report.json").unlink(), "report.json"),
        (lambda out: (out / "centers.npz").write_bytes(b"PK"), "centers.npz"),
        (lambda out: (out / "reference" / "group_001.ply").unlink(), "group_001.ply"),
        (lambda out: (out / "playback" / "group_001-0.pc2").write_bytes(b"POINT"), "group_001-0.pc2"),
        (lambda out: (out / "playback" / "group_001-0.pc2").write_bytes((out / "playback" / "group_000-0.pc2").read_bytes()), "42 points"),
        (lambda out: edit_report(out, lambda report: report["sequence"]["numbers"].append(77)), "frame 77"),
    ],
)
def test_broken_results_are_named(blender, ball, results, damage, message):
    damage(results)
    with pytest.raises(RuntimeError, match=message):
        blender.ops.refmesh.load_results(output=str(results))
    assert {member.name for member in bpy.data.objects} == {"ball", "ball source"} and not ball.refmesh.done


def test_active_member_leads_to_its_sequence(blender, solved):
    from refmesh_addon.properties.selection import sequence_object

    for member in bpy.data.collections["ball"].all_objects:
        blender.context.view_layer.objects.active = member
        assert sequence_object(blender.context) == solved


def test_spacing_of_a_grid_is_its_step():
    grid = np.stack(np.meshgrid(*[np.arange(4) * 0.5] * 3), axis=-1).reshape(-1, 3)
    assert spacing(grid) == pytest.approx(0.5)


def test_colors_by_place_stay_in_range_for_flat_clouds():
    colors = colors_by_place(np.column_stack([np.linspace(-3, 5, 7), np.zeros(7), np.ones(7)]))
    assert colors.shape == (7, 4) and colors.min() > 0 and colors.max() <= 1 and np.all(np.diff(colors[:, 0]) > 0)


def edit_report(out, change) -> None:
    report = json.loads((out / "report.json").read_text())
    change(report)
    (out / "report.json").write_text(json.dumps(report))


def test_far_places_are_listed_and_a_click_goes_there(blender, solved, results):
    places = [
        {"frame": number, "kind": kind, "distance": 0.4 / number, "position": [1.0, number, 0.0], "area": 0.01}
        for number, kind in ((7, "extra"), (10, "missing"))
    ]
    edit_report(results, lambda report: report.update(far_places=places))
    blender.context.scene.frame_set(6)
    blender.ops.refmesh.load_results()
    state = solved.refmesh
    assert [(item.name, item.kind) for item in state.places] == [("7", "extra"), ("10", "missing")]
    assert blender.context.scene.frame_current == 6, "loading goes nowhere"
    for index, number in enumerate((7, 10)):
        state.active_place = index
        assert blender.context.scene.frame_current == number
        np.testing.assert_allclose(blender.context.scene.cursor.location, [1.0, 0.0, number], atol=1e-5)  # Y up in the files
    edit_report(results, lambda report: report.pop("far_places"))
    blender.ops.refmesh.load_results()
    assert not state.places
