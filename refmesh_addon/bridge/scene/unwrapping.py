"""Layouts by Blender's angle-based flattening (Sheffer et al., "ABF++", TOG 2005), in a process of its own that shows nothing.

`run TASK RESULT SECONDS`, as `pipeline.session.flattening` starts it: .npz files with a mesh and, maybe, a layout whose charts are taken.
"""

from __future__ import annotations

import faulthandler
import os
import sys

import bpy
import numpy as np

from ...core.color.charts import charts_of, flawed_charts, joined_charts, seams
from ...core.types import TriangleMesh
from .meshes import fill_mesh, set_uvs

STEEPEST = np.radians(66.0)  # between the faces of a chart and its direction, as Smart UV Project has it by default
PADDING = 1 / 1024  # share of the texture's side around each chart: two texels at least between charts of a texture of 1024


def run(task: str, result: str, time_limit: float) -> None:
    """Ends by itself after the time limit, should nobody be left to end it."""
    with open(os.devnull, "w") as nowhere:
        faulthandler.dump_traceback_later(time_limit, exit=True, file=nowhere)
        given = np.load(task)
        corners = given["corners"] if "corners" in given else None
        np.savez(result, corners=flattened(TriangleMesh(given["vertices"], given["triangles"]), corners))
        faulthandler.cancel_dump_traceback_later()


def main() -> None:
    """`run` with the arguments that follow -- on the command line."""
    task, result, time_limit = sys.argv[sys.argv.index("--") + 1 :]
    run(task, result, float(time_limit))


def flattened(mesh: TriangleMesh, corners: np.ndarray | None) -> np.ndarray:
    """(T, 3, 2) float32 places of the triangles' corners, 0 to 1. Replaces the scene.

    corners : (T, 3, 2), a layout whose charts are taken; None takes those of Smart UV Project. Small charts join a neighbor; a chart that
    then cannot be flattened well stays as it was.
    """
    item = _edited(mesh)
    start = _smart(item) if corners is None else corners.astype(np.float32)
    charts = joined_charts(mesh, charts_of(mesh, start))
    result = _packed(item, _flat(item, seams(mesh, charts)))
    flawed = flawed_charts(mesh, result.astype(np.float64), charts)[charts]
    return _packed(item, np.where(flawed[:, None, None], start, result)) if flawed.any() else result


def _edited(mesh: TriangleMesh) -> bpy.types.Object:
    """The mesh as the only object, for the operators of UV maps, which take what is selected."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    data = bpy.data.meshes.new("unwrapped")
    fill_mesh(data, mesh)
    set_uvs(data, np.zeros((len(mesh.triangles), 3, 2)))
    data.polygons.foreach_set("select", np.ones(len(data.polygons), bool))
    item = bpy.data.objects.new(data.name, data)
    bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.objects.active = item
    bpy.context.scene.tool_settings.use_uv_select_sync = True
    return item


def _smart(item: bpy.types.Object) -> np.ndarray:
    return _changed(item, lambda: bpy.ops.uv.smart_project(angle_limit=STEEPEST, island_margin=0.0, area_weight=0.0))


def _flat(item: bpy.types.Object, cut: np.ndarray) -> np.ndarray:
    """Places after angle-based flattening with (3 T,) half-edges as seams."""
    edges, marked = np.empty(len(cut), np.int32), np.zeros(len(item.data.edges), bool)
    item.data.loops.foreach_get("edge_index", edges)
    marked[edges[cut]] = True
    item.data.edges.foreach_set("use_seam", marked)
    return _changed(item, lambda: bpy.ops.uv.unwrap(method="ANGLE_BASED", fill_holes=True, correct_aspect=False, margin=0.0))


def _packed(item: bpy.types.Object, corners: np.ndarray) -> np.ndarray:
    """Places of all charts brought to one scale, turned and packed, by their outlines."""
    set_uvs(item.data, corners)

    def pack() -> None:
        bpy.ops.uv.average_islands_scale()
        bpy.ops.uv.pack_islands(rotate=True, scale=True, margin_method="ADD", margin=PADDING, shape_method="CONCAVE")

    return _changed(item, pack)


def _changed(item: bpy.types.Object, work) -> np.ndarray:
    """(T, 3, 2) float32 places after an operator of edit mode."""
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    work()
    bpy.ops.object.mode_set(mode="OBJECT")
    places = np.empty(2 * len(item.data.loops), np.float32)
    item.data.uv_layers.active.uv.foreach_get("vector", places)
    return places.reshape(-1, 3, 2)
