"""What one sees besides the results: colors and trails of the centers, errors in color."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from refmesh_addon.bridge.results.center_colors import colors_by_number, colors_by_size
from refmesh_addon.bridge.results.heat_map import ATTRIBUTE, MATERIAL_NAME
from refmesh_addon.bridge.scene.meshes import COLOR_NAME
from refmesh_addon.core.evaluation.error_scale import to_linear
from refmesh_addon.core.findings import CENTER_ATTRIBUTES
from refmesh_addon.io.ply import read_colors, write_ply

from .conftest import CENTERS, place, reference


def colors(member: bpy.types.Object, name: str = COLOR_NAME) -> np.ndarray:
    flat = np.empty(4 * len(member.data.vertices), dtype=np.float32)
    member.data.attributes[name].data.foreach_get("color", flat)
    return flat.reshape(-1, 4)


@pytest.mark.parametrize("choice", [name.upper() for name in CENTER_ATTRIBUTES])
def test_centers_take_the_colors_of_a_figure_and_say_what_they_mean(solved, choice):
    before = colors(solved.refmesh.centers)
    solved.refmesh.center_color = choice
    after = colors(solved.refmesh.centers)
    assert len(after) == CENTERS and not np.array_equal(after, before) and solved.refmesh.center_range
    solved.refmesh.center_color = "PLACE"
    np.testing.assert_array_equal(colors(solved.refmesh.centers), before)


def test_size_of_the_centers_is_a_factor(solved):
    (radius,) = [node.inputs["Radius"] for node in _nodes(solved) if node.bl_idname == "GeometryNodeMeshIcoSphere"]
    before = radius.default_value
    solved.refmesh.center_size = 2.0
    assert radius.default_value == pytest.approx(2 * before)


def _nodes(owner):
    return owner.refmesh.centers.modifiers["RefMesh Points"].node_group.nodes


def test_each_body_has_a_color_of_its_own_and_the_scale_rises():
    assert len(np.unique(np.round(colors_by_number(np.arange(12.0)), 3), axis=0)) == 12
    scale = colors_by_size(np.linspace(0, 2, 9), 1.0)[:, :3].sum(axis=1)
    assert np.all(np.diff(scale[:5]) > 0) and np.ptp(scale[5:]) == 0
    assert np.isfinite(colors_by_size(np.zeros(3), 0.0)).all()


def test_trails_follow_the_selected_centers(blender, solved):
    points = solved.refmesh.centers.data
    chosen = np.arange(CENTERS) % 10 == 0
    points.vertices.foreach_set("select", chosen)
    blender.ops.refmesh.show_trails()
    splines = solved.refmesh.trails.data.splines
    assert len(splines) == chosen.sum()
    start = np.random.default_rng(0).normal(size=(CENTERS, 3))
    for spline, index in zip(splines, np.flatnonzero(chosen)):
        for point, number in zip(spline.points, (6, 7, 8, 8, 10, 11)):
            np.testing.assert_allclose(point.co[:3], place(start, number)[index], rtol=1e-5)


def test_trails_are_replaced_and_removed_whole(blender, solved):
    before = len(bpy.data.curves), len(bpy.data.objects)
    blender.ops.refmesh.show_trails()
    blender.ops.refmesh.show_trails()
    assert len(bpy.data.curves) == before[0] + 1
    blender.ops.refmesh.remove_trails()
    assert (len(bpy.data.curves), len(bpy.data.objects)) == before
    with pytest.raises(RuntimeError, match="there are no trails"):
        blender.ops.refmesh.remove_trails()


def test_trails_need_centers(blender, ball):
    with pytest.raises(RuntimeError, match="run the Track step first"):
        blender.ops.refmesh.show_trails()


def test_errors_follow_the_timeline(solved, results):
    solved.refmesh.heat_map = True
    for number, index in ((6, 0), (8, 0), (9, 0), (11, 1), (99, 1)):
        bpy.context.scene.frame_set(number)
        shown = {9: 8, 99: 11}.get(number, number)
        expected = to_linear(read_colors(results / "deformed" / f"frame_{shown:04d}.ply") / 255.0)
        deformed = solved.refmesh.groups[index].deformed
        np.testing.assert_allclose(colors(deformed, ATTRIBUTE), expected, atol=1e-6)
        assert rendered_materials(deformed) == {MATERIAL_NAME}
    solved.refmesh.heat_map = False
    for number, group in zip((6, 11), solved.refmesh.groups):
        bpy.context.scene.frame_set(number)
        assert rendered_materials(group.deformed) == {"RefMesh Deformed"} and ATTRIBUTE not in group.deformed.data.attributes


def rendered_materials(member: bpy.types.Object) -> set[str]:
    """Names of the materials that faces of the evaluated object have."""
    evaluated = member.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return {evaluated.data.materials[face.material_index].name for face in evaluated.data.polygons}


def test_solid_views_color_by_attribute_while_there_are_colors_to_see(solved):
    views = [space.shading for screen in bpy.data.screens for area in screen.areas for space in area.spaces if space.type == "VIEW_3D"]
    shading = [item for item in views if item.color_type == "MATERIAL"]
    assert shading
    for switch in ("show_centers", "heat_map"):
        setattr(solved.refmesh, switch, True)
        assert {item.color_type for item in shading} == {"VERTEX"}
        setattr(solved.refmesh, switch, False)
        assert {item.color_type for item in shading} == {"MATERIAL"}
    shading[0].color_type = "RANDOM"  # as a person has set it
    solved.refmesh.heat_map = True
    solved.refmesh.heat_map = False
    assert shading[0].color_type == "RANDOM"


def test_errors_stay_shown_when_results_are_loaded_again(blender, solved):
    solved.refmesh.heat_map = True
    blender.ops.refmesh.load_results()
    assert solved.refmesh.heat_map and ATTRIBUTE in solved.refmesh.groups[0].deformed.data.attributes


def test_colors_of_a_file_without_them_are_refused(tmp_path):
    write_ply(tmp_path / "plain.ply", reference(0))
    for name, message in (("plain.ply", "holds no colors"), ("gone.ply", "cannot be read")):
        with pytest.raises(Exception, match=message):
            read_colors(tmp_path / name)


def test_errors_that_are_not_there_switch_the_colors_off_again(ball):
    ball.refmesh.heat_map = True
    assert not ball.refmesh.heat_map
