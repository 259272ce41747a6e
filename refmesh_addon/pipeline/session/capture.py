"""Each file of a sequence read and parsed once: cleaned for the stages, and as it came for Blender's preview.

Both are in one cache entry, with a key from the bytes of the file. Blender, which must not read whole files to find its preview,
knows the same entry under a second name, derived from name, size and time of the file.
"""

from __future__ import annotations

import filecmp
import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from ...core.capture.cleaning import CapturedFrame, cleaned
from ...core.capture.floaters import without_floaters
from ...core.capture.pieces import Pieces, pieces_of
from ...core.errors import RefMeshError
from ...io.files import atomic_file, output_folder, remove_if_possible
from ...io.meshes import parse_frame, read_bytes
from ...io.preview import PreviewMesh, preview_path
from ...io.sequence import Frame, Sequence
from .cache import digest
from .cached_map import WorkUnit, cached_map
from .session import Session
from .stage_share import StageShare

FRAME_SCHEMA = 12


@dataclass(frozen=True)
class CapturedFile(PreviewMesh):
    """A file of the sequence: the mesh as it came, as Blender shows it, and cleaned.

    omitted_faces : faces of the file that were left out because they have fewer than three corners.
    pieces : of the cleaned mesh without floaters.
    """

    captured: CapturedFrame
    omitted_faces: int
    pieces: Pieces


@dataclass(frozen=True)
class CapturedSequence:
    """keys : index of each frame that can be read -> derived from the bytes of its file.  files : read from the cache on access."""

    keys: dict[int, str]
    files: Mapping[int, CapturedFile]

    def only(self, kept: Iterable[int]) -> CapturedSequence:
        """Some of the frames, numbered anew from 0."""
        names = dict(enumerate(kept))
        return CapturedSequence({new: self.keys[old] for new, old in names.items()}, _Renamed(self.files, names))


@dataclass(frozen=True)
class _Renamed(Mapping[int, CapturedFile]):
    """Files under other names.  names : new -> old."""

    files: Mapping[int, CapturedFile]
    names: dict[int, int]

    def __getitem__(self, name: int) -> CapturedFile:
        return self.files[self.names[name]]

    def __iter__(self) -> Iterator[int]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)


def capture_sequence(
    session: Session, sequence: Sequence, share: StageShare, failed: Callable[[int, RefMeshError], None] | None = None
) -> CapturedSequence:
    """All frames of a sequence; only files that are new or have changed are parsed.

    failed : called with the index of a frame that cannot be used, and why. Without it the first RefMeshError is raised.
    """
    units = {}
    for index, frame in enumerate(sequence.frames):
        share.tell(session.notify, 0.0)
        try:
            units[index] = _unit(frame)
        except RefMeshError as error:
            if failed is None:
                raise
            failed(index, error)
    try:
        files = cached_map(session, capture, units, CapturedFile, share, failed)
    finally:  # also for what is done when the job is canceled
        for index, unit in units.items() if session.part is None else ():  # one process alone writes links
            _link_preview(session, unit, sequence.frames[index])
    return CapturedSequence({index: units[index].key for index in files}, files)


def capture(path: Path, key: str) -> CapturedFile:
    """A file of which the bytes give the `key`. Raises RefMeshError, naming it, when it cannot be used or has changed."""
    data = read_bytes(path)
    if _key(data) != key:
        raise RefMeshError(f"{path}: the file changed while it was read; start the run again")
    mesh, omitted = parse_frame(data, path)
    captured = cleaned(mesh)
    pieces = pieces_of(without_floaters(captured.mesh))
    return CapturedFile(**vars(PreviewMesh.of(mesh)), captured=captured, omitted_faces=omitted, pieces=pieces)


def _unit(frame: Frame) -> WorkUnit:
    key = _key(read_bytes(frame.path))
    return WorkUnit(f"frames/frame_{frame.number:04d}", key, lambda: (frame.path, key), frame.number, str(frame.path))


def _link_preview(session: Session, unit: WorkUnit, frame: Frame) -> None:
    """The cache entry under the name that Blender looks for; a copy where the disk has no links. None for a frame without an entry."""
    entry = session.cache.path(unit.entry, unit.key)
    if not frame.path.exists():
        return
    preview = preview_path(session.output, frame.path)
    if preview.is_file() and entry.exists() and (os.path.samefile(entry, preview) or filecmp.cmp(entry, preview, shallow=False)):
        return
    remove_if_possible(preview)
    if not entry.exists():
        return
    output_folder(preview.parent)
    try:
        os.link(entry, preview)
    except OSError:
        with atomic_file(preview) as file, open(entry, "rb") as source:
            shutil.copyfileobj(source, file)


def _key(data: bytes) -> str:
    return digest(FRAME_SCHEMA, data)
