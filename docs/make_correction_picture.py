"""Make the picture of a correction by hand: `python docs/make_correction_picture.py OUT`, where OUT is a finished run of the sample.

Edit Shape, a bump on the ball and Apply Edit, in the first frame; drawn are that frame before and after, and the last frame of the group,
to which the bump has followed the surface.
"""

from __future__ import annotations

import sys
from pathlib import Path

import bpy
import numpy as np
from make_pictures import GAP, LINE, PICTURES, QUALITY, RESULT_COLOR, ROOT, SAMPLE, show, turned
from PIL import Image

sys.path.insert(0, str(ROOT))

import refmesh_addon  # noqa: E402
from refmesh_addon.bridge.picture.studio import render, studio, write  # noqa: E402
from refmesh_addon.bridge.scene.meshes import read_positions, set_positions  # noqa: E402
from refmesh_addon.core.types import TriangleMesh  # noqa: E402
from refmesh_addon.io.pc2 import read_pc2  # noqa: E402
from refmesh_addon.io.ply import read_surface  # noqa: E402
from refmesh_addon.io.report import read_report  # noqa: E402

WIDTH = 1000  # pixels
HEIGHT, RADIUS = 0.14, 0.10  # of the bump, as shares of the size of the mesh


def main(out: Path) -> None:
    """Corrects the first group and writes docs/pictures/correction.jpg."""
    refmesh_addon.register()
    bpy.ops.refmesh.import_sequence(filepath=str(SAMPLE), empty_scene=True)
    owner = bpy.context.active_object
    bpy.ops.refmesh.load_results(output=str(out))
    entry, group = read_report(out)["groups"][0], owner.refmesh.groups[0]
    rest, before = read_surface(out / entry["reference"]), list(read_pc2(out / entry["playback"]))
    bpy.context.scene.frame_set(group.start)
    bpy.ops.refmesh.edit_shape()
    mesh = group.deformed.data
    set_positions(mesh, bumped(read_positions(mesh), rest))
    bpy.ops.refmesh.apply_edit()
    after = list(read_pc2(Path(bpy.path.abspath(group.deformed.modifiers["RefMesh Playback"].filepath))))
    last = len(before) - 1
    shapes = {"result": before[0], "with a correction": after[0], f"{last} frames later": after[last]}
    draw([turned(rest.moved(shape.astype(float))) for shape in shapes.values()], list(shapes), out / "correction.png")
    Image.open(out / "correction.png").convert("RGB").save(PICTURES / "correction.jpg", quality=QUALITY, optimize=True)
    refmesh_addon.unregister()


def bumped(positions: np.ndarray, rest: TriangleMesh) -> np.ndarray:
    """The vertices with a smooth bump at the highest one, upward."""
    size = np.ptp(rest.vertices, axis=0).max()
    top = positions[positions[:, 1].argmax()]
    share = np.exp(-((np.linalg.norm(positions - top, axis=1) / (RADIUS * size)) ** 2))
    return positions + np.where(share > 0.01, HEIGHT * size * share, 0.0)[:, None] * [0.0, 1.0, 0.0]


def draw(meshes: list[TriangleMesh], titles: list[str], target: Path) -> None:
    """Renders the shapes beside each other, with titles below."""
    low = np.min([mesh.vertices.min(axis=0) for mesh in meshes], axis=0)
    high = np.max([mesh.vertices.max(axis=0) for mesh in meshes], axis=0)
    width, height, depth = high - low
    column = (1 + GAP) * width
    line = 2 * LINE * column
    with studio() as scene:
        for place, (mesh, title) in enumerate(zip(meshes, titles)):
            show(scene, mesh.moved(mesh.vertices + [place * column - (low + high)[0] / 2, -low[1], 0.0]), None, ("result", RESULT_COLOR))
            write(scene, title, (place * column, -line), line)
        right = (len(meshes) - 0.5) * column
        render(scene, np.array([-column / 2, -3 * line, low[2]]), np.array([right, height + line, low[2] + depth]), target, WIDTH)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
