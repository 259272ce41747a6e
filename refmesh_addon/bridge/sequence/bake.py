"""Any animated mesh object as a mesh sequence: its evaluated mesh in each scene frame, written to files."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import RefMeshError
from ...core.types import TriangleMesh
from ...io.files import PARTIAL_SUFFIX, output_folder
from ..scene.meshes import read_positions
from .object_colors import evaluated_colors, write_object_frame

DIGITS = 4  # of the frame number in a file name, at least


def evaluated_mesh(target: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> TriangleMesh:
    """What a render would see of the object now, with all modifiers, in world coordinates."""
    evaluated = target.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        mesh.calc_loop_triangles()
        corners = np.empty(3 * len(mesh.loop_triangles), dtype=np.int32)
        mesh.loop_triangles.foreach_get("vertices", corners)
        matrix = np.array(evaluated.matrix_world, dtype=float)
        vertices = read_positions(mesh) @ matrix[:3, :3].T + matrix[:3, 3] if len(mesh.vertices) else np.empty((0, 3))
    finally:
        evaluated.to_mesh_clear()
    triangles = corners.reshape(-1, 3)
    return TriangleMesh(vertices, triangles[:, ::-1] if np.linalg.det(matrix[:3, :3]) < 0 else triangles)


def bake(target: bpy.types.Object, scene: bpy.types.Scene, numbers: Sequence[int], folder: Path) -> Iterator[int]:
    """Writes one PLY for each scene frame into the folder; yields each number when its file is there.

    A frame in which the object has no faces is left out, as a gap. The files appear all together at the end, in place
    of those of an earlier bake; when the iteration ends early, none does. The scene then shows the frame it showed before.
    Raises RefMeshError when no frame has faces or the files cannot be written.
    """
    stem = bpy.path.clean_name(target.name)
    partial = folder.with_name(folder.name + PARTIAL_SUFFIX)
    shutil.rmtree(partial, ignore_errors=True)  # of a bake that was killed, perhaps of other frames
    output_folder(partial)
    before = scene.frame_current
    try:
        for number in numbers:
            scene.frame_set(number)
            graph = bpy.context.evaluated_depsgraph_get()
            mesh = evaluated_mesh(target, graph)
            if len(mesh.triangles):
                write_object_frame(partial / f"{stem}_{number:0{DIGITS}d}.ply", mesh, evaluated_colors(target, graph))
            yield number
        written = sorted(partial.iterdir())
        if not written:
            span = f"frames {numbers[0]} to {numbers[-1]}"
            raise RefMeshError(f"'{target.name}' has no faces in {span}; choose other frames or another object")
        _replace(written, output_folder(folder), stem)
    finally:
        shutil.rmtree(partial, ignore_errors=True)
        scene.frame_set(before)


def _replace(written: Sequence[Path], folder: Path, stem: str) -> None:
    names = {path.name for path in written}
    for path in folder.glob("*.ply"):
        if re.fullmatch(re.escape(stem) + r"_[0-9]+\.ply", path.name) and path.name not in names:
            path.unlink()
    for path in written:
        os.replace(path, folder / path.name)
