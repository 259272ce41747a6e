"""A small sequence and its results as real files, and a Blender with the add-on registered."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest
import trimesh

import refmesh_addon
from refmesh_addon.core.evaluation.distances import Distances
from refmesh_addon.core.evaluation.error_scale import error_colors
from refmesh_addon.core.settings import Settings
from refmesh_addon.core.tracking.center_attributes import center_attributes
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.discovery import find_sequence
from refmesh_addon.io.files import write_npz
from refmesh_addon.io.pc2 import write_pc2
from refmesh_addon.io.ply import write_ply
from refmesh_addon.io.report import FrameReport, GroupReport, Report
from refmesh_addon.pipeline.process.reading import SHARED

needs_bpy_module = pytest.mark.skipif(bool(bpy.app.binary_path), reason="starts a Python with bpy, which only the bpy package has")
NUMBERS = (6, 7, 8, 10, 11)  # 9 is missing
GROUPS = ((6, 7, 8), (10, 11))
CENTERS = 30


@pytest.fixture(scope="session", autouse=True)
def one_reading_process():
    """Serves all tests, as starting it takes longer than most of them; the add-on ends it when it is disabled."""
    SHARED.close = lambda: None
    yield
    del SHARED.close
    SHARED.close()


@pytest.fixture
def blender():
    """bpy with an empty scene and the add-on registered."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    refmesh_addon.register()
    yield bpy
    refmesh_addon.unregister()


@pytest.fixture
def frames(tmp_path) -> Path:
    """Folder of an ellipsoid that moves and grows, with another triangulation in every frame."""
    return write_frames(tmp_path / "ball")


@pytest.fixture
def results(frames, tmp_path) -> Path:
    """What a complete run would leave for `frames`: one reference sphere for each group, moved as the frames are."""
    return write_results(tmp_path / "out", frames)


@pytest.fixture
def ball(blender, frames):
    """The sequence object of `frames`, imported."""
    blender.ops.refmesh.import_sequence(filepath=str(frames))
    return blender.context.active_object


@pytest.fixture
def solved(blender, ball, results):
    """The sequence object with its results loaded."""
    blender.ops.refmesh.load_results(output=str(results))
    return ball


def write_frames(folder: Path, offset: np.ndarray | float = 0.0) -> Path:
    """offset : (3,), from the origin."""
    folder.mkdir()
    for number in NUMBERS:
        sphere = trimesh.creation.uv_sphere(count=[8 + number % 3, 9])
        (folder / f"ball_{number:04d}.obj").write_text(_obj(place(sphere.vertices, number) + offset, sphere.faces))
    return folder


def place(vertices: np.ndarray, number: int) -> np.ndarray:
    """The motion that the frames show, for any points on the unit sphere."""
    return vertices * [1.0, 1.5 + 0.1 * number, 0.8] + [0.1 * number, 2.0, 0.0]


def velocities(vertices: np.ndarray, number: int) -> np.ndarray:
    """Not those of the motion: other ones in every frame and vertex, so that a test can tell them apart."""
    return (np.sin(5 * vertices + number) + [0.0, 0.0, 0.2 * number]).astype(np.float32)


def reference(index: int) -> TriangleMesh:
    """The reference mesh of a group; each group has another number of vertices."""
    sphere = trimesh.creation.icosphere(subdivisions=1 + index)
    return TriangleMesh(sphere.vertices, sphere.faces)


def write_results(out: Path, frames: Path, offset: tuple[float, ...] = (0.0, 0.0, 0.0)) -> Path:
    """offset : of all positions from the origin, about which playback files are."""
    for folder in ("reference", "deformed", "playback"):
        (out / folder).mkdir(parents=True, exist_ok=True)
    report = Report(str(frames), find_sequence(frames), Settings(), bbox_diagonal=4.0, centers_playback="playback/centers-0.pc2")
    report.offset = offset
    points = np.random.default_rng(0).normal(size=(CENTERS, 3))
    timeline = [max(number for number in NUMBERS if number <= frame) for frame in range(NUMBERS[0], NUMBERS[-1] + 1)]
    write_pc2(out / report.centers_playback, [place(points, number) for number in timeline], CENTERS, len(timeline))
    positions = np.array([place(points, number) for number in NUMBERS])
    write_npz(out / "centers.npz", {"frames": np.array(NUMBERS), "positions": positions + offset, **center_attributes(positions, 0.5)})
    for index, numbers in enumerate(GROUPS):
        _write_group(out, report, index, numbers)
    report.write(out)
    return out


def _write_group(out: Path, report: Report, index: int, numbers: tuple[int, ...]) -> None:
    mesh = reference(index)
    group = GroupReport(
        index=index,
        frames=numbers,
        anchor=numbers[0],
        reference=f"reference/group_{index:03d}.ply",
        triangles=len(mesh.triangles),
        components=1,
        watertight=True,
        stress=0.01,
        iou_before=0.9,
        iou_after=0.95,
        frame_iou_before=(0.9,) * len(numbers),
        frame_iou_after=(0.95,) * len(numbers),
        self_intersections=0,
        playback=f"playback/group_{index:03d}-0.pc2",
    )
    report.groups.append(group)
    write_ply(out / group.reference, mesh.moved(mesh.vertices + report.offset))
    write_pc2(out / group.playback, [place(mesh.vertices, number) for number in numbers], len(mesh.vertices), len(numbers))
    for number in numbers:
        distances = Distances(0.001 * number, 0.002, 0.003, 0.004)
        frame = FrameReport(
            number,
            index,
            f"deformed/frame_{number:04d}.ply",
            source_to_deformed=distances,
            deformed_to_source=distances,
            d1_psnr=60.0,
            d2_psnr=70.0,
        )
        colors = error_colors(0.002 * (1 + mesh.vertices[:, 1]))
        write_ply(out / frame.deformed, mesh.moved(place(mesh.vertices, number) + report.offset), colors, velocities(mesh.vertices, number))
        report.frames.append(frame)


def read_triangles(source: bpy.types.Mesh) -> np.ndarray:
    """(T, 3) int32 vertices of the triangles of a Blender mesh that has no other polygons."""
    flat = np.empty(len(source.loops), dtype=np.int32)
    source.loops.foreach_get("vertex_index", flat)
    return flat.reshape(-1, 3)


def _obj(vertices: np.ndarray, triangles: np.ndarray) -> str:
    lines = [f"v {x:.15g} {y:.15g} {z:.15g}" for x, y, z in vertices]
    return "\n".join(lines + [f"f {a} {b} {c}" for a, b, c in triangles + 1]) + "\n"
