"""The preview picture."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

KINDS = ("scenes", "worlds", "lights", "cameras", "curves", "meshes", "objects")


def pixels_of(path) -> np.ndarray:
    image = bpy.data.images.load(str(path))
    pixels = np.array(image.pixels[:]).reshape(image.size[1], image.size[0], 4)
    bpy.data.images.remove(image)
    return pixels


def test_three_meshes_stand_apart_on_a_light_background(blender, solved, tmp_path):
    before = {kind: len(getattr(bpy.data, kind)) for kind in KINDS}
    blender.ops.refmesh.render_preview(filepath=str(tmp_path / "new" / "picture.png"), width=160)
    assert {kind: len(getattr(bpy.data, kind)) for kind in KINDS} == before
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["picture.png"]
    pixels = pixels_of(tmp_path / "new" / "picture.png")
    assert pixels.shape[1] == 160
    row = pixels[int(0.5 * len(pixels)), :, :3]
    covered = np.abs(row - row[0]).max(axis=1) > 0.05
    assert row[0].min() > 0.7
    assert np.count_nonzero(np.diff(covered.astype(int)) == 1) == 3
    red, blue = pixels[..., 0], pixels[..., 2]
    assert (blue - red > 0.2).any() and (red - blue > 0.4).any()  # both ends of the error scale


def test_the_source_shows_its_colors_where_the_scene_does(blender, frames, results, tmp_path):
    for path in frames.iterdir():
        lines = path.read_text().splitlines()
        path.write_text("\n".join(f"{line} 0.05 0.8 0.05" if line.startswith("v ") else line for line in lines) + "\n")
    blender.ops.refmesh.import_sequence(filepath=str(frames))
    blender.ops.refmesh.load_results(output=str(results))
    greens = []
    for shown in (True, False):
        blender.context.active_object.refmesh.source_colors = shown
        blender.ops.refmesh.render_preview(filepath=str(tmp_path / "picture.png"), width=160)
        source = pixels_of(tmp_path / "picture.png")[:, : 160 // 3, :3]
        greens.append(np.count_nonzero(source[..., 1] - source[..., 0] > 0.3))
    assert greens[0] > 100 and greens[1] == 0


def test_no_results_for_the_frame_is_said(blender, ball, results, tmp_path):
    with pytest.raises(RuntimeError, match="report.json"):
        blender.ops.refmesh.render_preview(filepath=str(tmp_path / "picture.png"), width=160)
    assert not (tmp_path / "picture.png").exists()
