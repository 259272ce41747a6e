"""Groups that captures rarely give, in every compressed form: a small GLB, textures for game engines, a stream."""

import json

import numpy as np
import pytest

from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.refmesh_stream.reader import StreamReader
from refmesh_addon.io.refmesh_stream.writer import FrameGroup, Quality, write_stream
from refmesh_addon.io.small_glb.choice import SmallGlb
from refmesh_addon.io.small_glb.writer import write_small_glb
from refmesh_addon.io.vat.writer import VatChoice, write_vat
from tests.core import shapes
from tests.io.refmesh_stream.bodies import waving
from tests.io.small_glb.unpacking import Glb
from tests.io.vat.bodies import read_png, shown

DIAGONAL, RATE, ERROR = 4.0, 30.0, 2e-3
TWO_BODIES = shapes.joined(shapes.ball(1), shapes.torus())
SMALL = shapes.ball(1)


def bounded(mesh, frames):
    """A motion that goes on and on without leaving its place."""
    times = np.arange(frames)[:, None]
    x, y, z = mesh.vertices.T
    return np.stack([x * np.ones((frames, 1)), y + 0.2 * np.sin(0.3 * times + 2 * x), z + 0.2 * np.cos(0.2 * times + 3 * x)], axis=2)


GROUPS = {
    "one frame": FrameGroup((7,), SMALL.vertices[None], SMALL.triangles),
    "never moves": FrameGroup((1, 2, 3, 4), np.repeat(SMALL.vertices[None], 4, axis=0), SMALL.triangles),
    "several bodies": FrameGroup((1, 2, 3), waving(TWO_BODIES, 3), TWO_BODIES.triangles),
    "300 frames": FrameGroup(tuple(range(1, 301)), bounded(SMALL, 300), SMALL.triangles),
    "below zero and with gaps": FrameGroup((-3, 0, 1), waving(SMALL, 3), SMALL.triangles),
}
every_group = pytest.mark.parametrize("group", GROUPS.values(), ids=GROUPS.keys())


def rms(group, frame, vertices):
    distances = SurfaceIndex(TriangleMesh(group.positions[frame], group.triangles)).query(vertices).distances
    return np.sqrt((distances**2).mean())


def chosen(group):
    """Some rows of the frames, the last among them."""
    return sorted({*range(0, len(group.numbers), 37), len(group.numbers) - 1})


@every_group
def test_a_small_glb_shows_them(tmp_path, group):
    written = write_small_glb(tmp_path / "group.glb", [group], DIAGONAL, RATE, SmallGlb(error=ERROR))
    assert [number for run in written for number in run.numbers] == list(group.numbers)
    assert all(len(run.numbers) <= 8 or run.error <= ERROR * 1.001 for run in written)
    glb = Glb((tmp_path / "group.glb").read_bytes())
    for frame in chosen(group):
        vertices, _ = glb.at((group.numbers[frame] - group.numbers[0]) / RATE)
        assert rms(group, frame, vertices) < 2 * ERROR * DIAGONAL


@every_group
def test_a_stream_holds_them(tmp_path, group):
    pytest.importorskip("constriction")
    write_stream(tmp_path / "group.refmesh", [group], DIAGONAL, RATE, Quality(ERROR))
    reader = StreamReader(tmp_path / "group.refmesh")
    parts = [reader.group(index) for index in range(len(reader.entries))]
    assert [number for part in parts for number in part.numbers] == list(group.numbers)
    positions = np.concatenate([part.positions for part in parts])
    for frame in chosen(group):
        assert rms(group, frame, positions[frame]) < 2 * ERROR * DIAGONAL


@every_group
def test_textures_for_game_engines_hold_them(tmp_path, group):
    paths = {path.name: path for path in write_vat(tmp_path, "group", group, RATE, VatChoice()).paths}
    remap = json.loads(paths["group-remap_info.json"].read_text())
    pictures = [read_png(paths[f"group_{kind}.png"].read_bytes()) for kind in ("vat", "vnrm")]
    for frame in chosen(group):
        x, y, z = shown(Glb(paths["group.glb"].read_bytes()), *pictures, remap, group.numbers[frame] - group.numbers[0])[0].T
        assert rms(group, frame, np.column_stack([x, -z, y])) < 1e-4
