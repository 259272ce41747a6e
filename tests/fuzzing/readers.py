"""How a file of each kind is read: as the pipeline and the add-on do. What is wrong must end in an error that names the file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.io.appearance import parse_appearance
from refmesh_addon.io.discovery import find_sequence
from refmesh_addon.io.findings import read_findings
from refmesh_addon.io.images import decoded
from refmesh_addon.io.meshes import parse_frame
from refmesh_addon.io.mtl import map_names, parse_mtl
from refmesh_addon.io.pc2 import read_pc2
from refmesh_addon.io.ply import read_colors, read_surface
from refmesh_addon.io.preview import read_preview
from refmesh_addon.io.refmesh_stream.reader import StreamReader
from refmesh_addon.io.report import read_report
from refmesh_addon.io.result_arrays import read_centers, read_layout
from refmesh_addon.io.textures import missing_textures
from refmesh_addon.pipeline.session.cache import Cache
from refmesh_addon.pipeline.session.capture import CapturedFile
from refmesh_addon.pipeline.session.job import JobSpec

from .seeds import KEY

# Kind -> name of its file in a folder.
NAMES = {"report": "report.json", "findings": "sequence_check.json", "centers": "centers.npz", "entry": f"frame-{KEY[:12]}.npz"}
NAMES |= {"layout": "a.npz", "preview": "a.npz", "result": "a.ply", "pc2": "a.pc2", "refmesh": "a.refmesh"}


def read(kind: str, data: bytes, folder: Path) -> None:
    """Reads one file. Raises whatever escapes, and AssertionError for an error that does not name the file."""
    path = folder / NAMES.get(kind, f"frame_0001.{kind}")
    if kind in NAMES:
        path.write_bytes(data)
    try:
        _READERS[kind](data, path)
    except RefMeshError as refusal:
        assert "\n" not in str(refusal) or kind == "source", "an error has one line, unless a path has more"
        assert str(refusal).startswith(str(path)) or kind in ("job", "source"), "an error names its file"


def _mesh(data: bytes, path: Path) -> None:
    parse_frame(data, path)
    parse_appearance(data, path)
    missing_textures(data, path)


def _materials(data: bytes, path: Path) -> None:
    parse_mtl(data)
    map_names(data)


def _stream(data: bytes, path: Path) -> None:
    reader = StreamReader(path)
    for index in range(len(reader.entries)):
        reader.group(index)


def _result(data: bytes, path: Path) -> None:
    read_surface(path)
    read_colors(path)


def _source(data: bytes, path: Path) -> None:
    find_sequence(f"{path.parent}/{data[:400].decode('utf-8', 'replace').replace('..', '').lstrip('/')}", "1-3")


_READERS: dict[str, Callable[[bytes, Path], object]] = {
    **dict.fromkeys(("obj", "ply", "stl", "glb", "off"), _mesh),
    "mtl": _materials,
    "image": lambda data, path: decoded(data, str(path)),
    "report": lambda data, path: read_report(path.parent),
    "findings": lambda data, path: read_findings(path.parent),
    "job": lambda data, path: JobSpec.from_json(data.decode("utf-8", "replace")).to_json(),
    "centers": lambda data, path: read_centers(path.parent),
    "layout": lambda data, path: read_layout(path, 3),
    "preview": lambda data, path: read_preview(path),
    "entry": lambda data, path: Cache(path.parent).load_result("frame", KEY, CapturedFile),
    "result": _result,
    "pc2": lambda data, path: list(read_pc2(path)),
    "refmesh": _stream,
    "source": _source,
}
