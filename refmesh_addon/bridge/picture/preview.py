"""Source, reference mesh and deformed mesh of one frame side by side, rendered without a graphics card."""

from __future__ import annotations

import contextlib
from math import pi
from pathlib import Path

import bpy
import numpy as np
from mathutils import Euler, Matrix

from ...core.errors import RefMeshError
from ...core.evaluation import error_scale
from ...core.types import TriangleMesh
from ...io.files import output_folder
from ...io.ply import read_surface
from ...io.preview import PreviewMesh
from ...io.report import read_report
from ...io.result_arrays import read_layout
from ..results.heat_map import read_error_colors
from ..results.textures import load_image
from ..scene.materials import REFERENCE_COLOR, attribute_material, image_material, plain_material
from ..scene.meshes import COLOR_NAME, fill_mesh, read_positions, set_colors, set_uvs
from ..sequence.raw_sequence import captured_colors, frame_at, read_frame
from ..sequence.source_colors import plain_source, show_colors
from .studio import add, draw_bar, render, studio, write

# Camera rotation: from the front, a little from the side and from above.
VIEW = Euler((pi / 2 - 0.2, 0.0, 0.45))
GAP = 0.15  # between two meshes, as a share of the widest
LINE = 0.018  # height of a line of text, as a share of the width of the picture
PLAIN_COLOR = (0.55, 0.56, 0.58, 1.0)  # a deformed mesh without error colors


def render_preview(owner: bpy.types.Object, scene_frame: int, results: Path, target: Path, width: int) -> None:
    """Writes a PNG, `width` pixels wide, of the frame shown at `scene_frame`: source, reference mesh of its group, deformed mesh,
    and this with captured and steady colors where there are textures. The source has its colors where the scene shows them.

    Raises RefMeshError when there are no results for the frame, or the picture cannot be written.
    """
    frame = frame_at(owner, scene_frame)
    group, entry = _results_of(int(frame.name), results)
    deformed = entry.get("deformed", "")
    output_folder(target.parent)
    with studio() as scene:
        labels = [f"source, frame {frame.name}", f"reference of group {group['index']}"]
        actors = [
            _source(scene, Path(bpy.path.abspath(frame.path)), results, owner.refmesh.source_colors),
            _actor(scene, read_surface(results / group["reference"]), plain_material("RefMesh Reference", REFERENCE_COLOR)),
        ]
        if deformed:
            actors.append(_read_colored(scene, results / deformed))
            labels.append("deformed")
        if entry.get("texture") and group.get("layout"):
            actors += [_textured(scene, results, group, deformed, picture) for picture in (entry["texture"], group["texture"])]
            labels += ["captured colors", "steady texture"]
        low, high = _line_up(actors, VIEW.to_matrix().transposed() @ owner.refmesh.root.matrix_world.to_3x3())
        low = _write_labels(scene, actors, labels, low, high)
        render(scene, low, high, target, width)


def _results_of(number: int, results: Path) -> tuple[dict, dict]:
    """Group and frame in the report; the frame is empty where it was not deformed yet."""
    report = read_report(results)
    entry = next((frame for frame in report["frames"] if frame["number"] == number), {})
    # A bad frame is in no group; its entry says whose mesh it shows.
    group = next((group for group in report["groups"] if number in group["frames"] or group["index"] == entry.get("group")), None)
    if group is None:
        raise RefMeshError(f"{results}: no reference mesh for frame {number}; run the steps first")
    return group, entry


def _actor(scene: bpy.types.Scene, mesh: TriangleMesh | PreviewMesh, material: bpy.types.Material) -> bpy.types.Object:
    data = bpy.data.meshes.new("RefMesh preview")
    # About an offset of its own: only its shape shows, and in single precision it has none far from the origin.
    fill_mesh(data, mesh if isinstance(mesh, PreviewMesh) else PreviewMesh.of(mesh))
    data.materials.append(material)
    return add(scene, "RefMesh preview", data)


def _source(scene: bpy.types.Scene, path: Path, results: Path, colored: bool) -> bpy.types.Object:
    """The captured mesh, in its own colors or plain."""
    actor = _actor(scene, read_frame(path, results), plain_source())
    show_colors(actor, captured_colors(path) if colored else None)
    return actor


def _read_colored(scene: bpy.types.Scene, path: Path) -> bpy.types.Object:
    actor = _actor(scene, read_surface(path), plain_material("RefMesh Plain", PLAIN_COLOR))
    with contextlib.suppress(RefMeshError):  # not measured yet
        set_colors(actor.data, read_error_colors(path))
        actor.data.materials[0] = attribute_material("RefMesh Error", COLOR_NAME)
    return actor


def _textured(scene: bpy.types.Scene, results: Path, group: dict, deformed: str, picture: str) -> bpy.types.Object:
    """The deformed mesh with a picture on the layout of its group."""
    actor = _actor(scene, read_surface(results / deformed), image_material(f"RefMesh {picture}", load_image(results / picture)))
    uvs, triangles = read_layout(results / group["layout"], len(actor.data.polygons))
    set_uvs(actor.data, uvs[triangles])
    return actor


def _has_colors(actor: bpy.types.Object) -> bool:
    return COLOR_NAME in actor.data.attributes


def _line_up(actors: list[bpy.types.Object], turn: Matrix) -> tuple[np.ndarray, np.ndarray]:
    """Places the actors in a row at the same height; returns the corners of the box around them, (3,) each."""
    boxes = []
    for actor in actors:
        turned = read_positions(actor.data) @ np.array(turn).T
        boxes.append((turned.min(axis=0), turned.max(axis=0)))
    lows, highs = np.array([box[0] for box in boxes]), np.array([box[1] for box in boxes])
    sizes = highs - lows
    gap = GAP * sizes[:, 0].max()
    lefts = np.concatenate([[0.0], np.cumsum(sizes[:-1, 0] + gap)])
    for actor, low, high, left in zip(actors, lows, highs, lefts, strict=True):
        middle = (low[2] + high[2]) / 2
        actor.matrix_world = Matrix.Translation((left - low[0], -low[1], -middle)) @ turn.to_4x4()
    depth = sizes[:, 2].max() / 2
    return np.array([-gap, 0.0, -depth]), np.array([lefts[-1] + sizes[-1, 0] + gap, sizes[:, 1].max() + gap, depth])


def _write_labels(scene: bpy.types.Scene, actors: list, labels: list[str], low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """A label below each actor, and below the last one its color scale; returns the new lower corner of the picture."""
    line = LINE * (high[0] - low[0])
    for actor, text in zip(actors, labels, strict=True):
        write(scene, text, (_middle(actor), -line), line)
    for actor in filter(_has_colors, actors):
        _draw_scale(scene, _middle(actor), -3 * line, line)
    return np.array([low[0], -7 * line, low[2]])


def _middle(actor: bpy.types.Object) -> float:
    across = np.array(actor.matrix_world)[0]
    places = read_positions(actor.data) @ across[:3] + across[3]
    return float(places.min() + places.max()) / 2


def _draw_scale(scene: bpy.types.Scene, middle: float, top: float, line: float) -> None:
    steps = np.linspace(0.0, error_scale.TOP, 33)
    colors = error_scale.to_linear(error_scale.error_colors(steps) / 255.0)
    width = 10 * line
    draw_bar(scene, (middle - width / 2, top - 0.8 * line), (width, 0.8 * line), colors)
    for share in (0.0, 0.5, 1.0):
        write(scene, f"{100 * share * error_scale.TOP:.2g} %", (middle + (share - 0.5) * width, top - line), 0.7 * line)
    write(scene, "distance, share of the diagonal", (middle, top - 2.1 * line), 0.7 * line)
