"""Intact files of every kind that is read: captures and what lies beside them, results, caches, jobs and compressed streams."""

from __future__ import annotations

import io
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image

from refmesh_addon.core.compression.group_encoder import Balance
from refmesh_addon.core.evaluation.distances import Distances
from refmesh_addon.core.findings import CENTER_ATTRIBUTES, Finding
from refmesh_addon.core.settings import Settings
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.files import write_npz
from refmesh_addon.io.findings import CHECK_NAME, write_findings
from refmesh_addon.io.pc2 import write_pc2
from refmesh_addon.io.ply import write_ply
from refmesh_addon.io.preview import PreviewMesh
from refmesh_addon.io.refmesh_stream.writer import Quality, write_stream
from refmesh_addon.io.report import FrameReport, GroupReport, Report
from refmesh_addon.io.sequence import Frame, Sequence
from refmesh_addon.pipeline.session.cache import Cache, digest
from refmesh_addon.pipeline.session.capture import capture_sequence
from refmesh_addon.pipeline.session.job import JobSpec
from refmesh_addon.pipeline.session.session import Session
from refmesh_addon.pipeline.session.stage_share import StageShare
from tests.io.refmesh_stream.bodies import torus_groups

BALL = trimesh.creation.icosphere(subdivisions=1)
MESH = TriangleMesh(BALL.vertices, BALL.faces)
KEY = digest("fuzz")
_TEXT = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nmtllib scan.mtl\nusemtl skin\nf 1/1 2/2 3/1\nf -4 -2 -1\nl 1 2\nf 1 2 \\ \n3\n"
_MTL = "newmtl skin\nKd 1 0.5 0\nmap_Kd -s 1 1 1 -bm 0.5 skin.png\nmap_Bump bump.png\n"
_MIXED = (
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty double y\nproperty short z\nelement face 2\n"
    "property list uchar int vertex_indices\nproperty list uchar float texcoord\nelement tristrips 1\n"
    "property list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 0\n4 0 1 2 3 2 0.5 0.5\n5 0 1 -1 2 3\n"
)


def _picture(extension: str, mode: str = "RGB") -> bytes:
    file, rng = io.BytesIO(), np.random.default_rng(0)
    image = Image.fromarray(rng.integers(0, 256, (16, 24, 3), dtype=np.uint8)).convert(mode)
    image.save(file, extension)
    return file.getvalue()


def _written(write: Callable[[Path], object], name: str) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder))
        return (Path(folder) / name).read_bytes()


def _report(folder: Path) -> None:
    frames = tuple(Frame(number, folder / f"f_{number}.obj") for number in (1, 2))
    report = Report(str(folder), Sequence("f", frames), Settings(), 2.0, centers_playback="playback/centers-0.pc2")
    overlaps = (0.9, 0.95, (0.9,) * 2, (0.95,) * 2, 0)
    report.groups.append(GroupReport(0, (1, 2), 1, "reference/group_000.ply", 80, 1, True, 0.1, *overlaps, "playback/a.pc2"))
    distances = Distances(0.001, 0.002, 0.003, 0.004)
    report.frames += [FrameReport(number, 0, f"deformed/frame_{number:04d}.ply", source_to_deformed=distances) for number in (1, 2)]
    report.tracking["center_spacing"] = 0.1
    report.write(folder)


def _centers(folder: Path) -> None:
    positions = np.random.default_rng(0).normal(size=(2, 5, 3))
    attributes = {name: np.zeros(5) for name in CENTER_ATTRIBUTES}
    write_npz(folder / "centers.npz", {"frames": np.array([1, 2]), "positions": positions, **attributes})


def _findings(folder: Path) -> None:
    write_findings(folder, Sequence("f", (Frame(1, folder / "f_1.obj"),)), [Finding("gap", "warning", 1, "missing")])


def _entry(folder: Path) -> None:
    """As a job writes it: the frame of a sequence of one."""
    path = folder / "frame_1.ply"
    write_ply(path, MESH)
    notify, share = lambda *_: None, StageShare("tracking", 0.0, 1.0)
    session = Session(folder, Cache(folder), _Here(), notify)
    frame = capture_sequence(session, Sequence("frame", (Frame(1, path),)), share).files[0]
    Cache(folder).save_result("frame", KEY, frame)


class _Here:
    """Does tasks in this process."""

    @staticmethod
    def map(function, tasks, poll):
        return ((index, function(*task)) for index, task in enumerate(tasks))


def _stream(folder: Path) -> None:
    write_stream(folder / "a.refmesh", torus_groups(), 4.0, 25.0, Quality(step=4e-3, balance=Balance(nodes=8)))


def _job() -> bytes:
    settings = Settings.from_flat({"mesh": "own.obj", "centers": 64})
    return JobSpec("in", "out", "1-2", settings, warnings=("a",), notes=("b",)).to_json().encode()


_LAYOUT = {"uvs": np.random.default_rng(0).random((9, 2)), "triangles": np.arange(9, dtype=np.int32).reshape(3, 3)}
SEEDS: dict[str, list[bytes]] = {
    "obj": [_TEXT.encode(), BALL.export(file_type="obj").encode()],
    "ply": [_MIXED.encode(), BALL.export(file_type="ply"), BALL.export(file_type="ply", encoding="ascii")],
    "stl": [BALL.export(file_type="stl"), BALL.export(file_type="stl_ascii").encode()],
    "glb": [BALL.export(file_type="glb")],
    "off": [BALL.export(file_type="off").encode()],
    "mtl": [_MTL.encode()],
    "image": [_picture("PNG"), _picture("PNG", "P"), _picture("PNG", "LA"), *map(_picture, ("JPEG", "TIFF", "TGA", "BMP", "WEBP"))],
    "report": [_written(_report, "report.json")],
    "findings": [_written(_findings, CHECK_NAME)],
    "job": [_job()],
    "centers": [_written(_centers, "centers.npz")],
    "layout": [_written(lambda folder: write_npz(folder / "a.npz", _LAYOUT), "a.npz")],
    "preview": [_written(lambda folder: write_npz(folder / "a.npz", vars(PreviewMesh.of(MESH))), "a.npz")],
    "entry": [_written(_entry, f"frame-{KEY[:12]}.npz")],
    "result": [_written(lambda folder: write_ply(folder / "a.ply", MESH, np.full((len(MESH.vertices), 4), 9, np.uint8)), "a.ply")],
    "pc2": [_written(lambda folder: write_pc2(folder / "a.pc2", [MESH.vertices] * 3, len(MESH.vertices), 3), "a.pc2")],
    "refmesh": [_written(_stream, "a.refmesh")],
    "source": [b"scan_####.obj", b"take/*/mesh_0001.ply", "größe 1.obj".encode()],
}
