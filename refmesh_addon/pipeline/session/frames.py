"""The frames of a sequence as the stages ask for them: by index, few in memory at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from ...core.capture.bad_frames import BadFrame, BadFrameSearch
from ...core.capture.cleaning import MeshStatistics
from ...core.capture.depth_artifacts import Artifacts, depth_artifacts
from ...core.capture.floaters import without_floaters
from ...core.capture.lasting_pieces import WINDOW, possible_surface, with_lasting_pieces
from ...core.capture.open_take import open_take
from ...core.capture.openness import CLOSED, DESCRIPTIONS, openness, surface_kind, take_kind
from ...core.capture.pieces import Pieces
from ...core.capture.strays import stray_note
from ...core.capture.transients import visits
from ...core.errors import RefMeshError
from ...core.geometry.mesh import submesh, vertex_components
from ...core.geometry.storage_offset import storage_offset
from ...core.settings import TrackingSettings
from ...core.surfacing.hole_caps import CappedMesh, smoothly_capped
from ...core.types import TriangleMesh
from ...io.frame_range import format_frames, format_ranges, format_selection
from ...io.sequence import Sequence
from .cache import digest
from .capture import CapturedSequence, capture_sequence
from .part import PartDone
from .session import Session
from .stage_share import StageShare
from .unusable_frames import unusable_frames

FRAMES_IN_MEMORY = 4  # enough for a frame, its neighbor and the anchor; a long take never fills the memory
OPEN_SCHEMA = 3  # of how the surfaces of open takes are cleaned and given a volume
LARGEST_SCALE_JUMP = 5.0  # between a frame's bounding-box diagonal and the median; bodies that come and go stay below


class _Survey:
    """What is small of each file, kept while the files are read one after the other.

    facing : (3,) mean normal of each frame.  boxes : lowest and highest corner of each.  The others as in `Frames`.
    """

    def __init__(self) -> None:
        self.counts: list[int] = []
        self.inside_out: list[bool] = []
        self.statistics: list[MeshStatistics] = []
        self.facing: list[np.ndarray] = []
        self.boxes: list[tuple[np.ndarray, np.ndarray]] = []
        self.large_pieces: list[int] = []
        self.bad_frames = BadFrameSearch()

    def pieces(self, captured: CapturedSequence) -> Iterator[Pieces]:
        """The pieces of each file, in order."""
        for file in captured.files.values():
            frame = file.captured
            self.counts.append(len(frame.mesh.triangles))
            self.inside_out.append(frame.inside_out)
            self.statistics.append(frame.statistics)
            self.facing.append(frame.facing)
            self.boxes.append((frame.mesh.vertices.min(axis=0), frame.mesh.vertices.max(axis=0)))
            self.large_pieces.append(file.pieces.large)
            self.bad_frames.add(file.pieces)
            yield file.pieces


class Frames:
    """Meshes of a sequence by index, seams closed, oriented outward.

    mesh(index) : as captured.  surface(index) : the same without floaters and transient pieces, what is followed and fitted.
    capped(index) : the surface with its holes capped, and which triangles cap them.  body(index) : the mesh of it, which encloses a volume.
    transient(index) : its transient pieces, which are shown as captured.  transients : index of each frame that has any -> their numbers;
    empty where the take is not closed.  coming, leaving : the same of lasting pieces, in their first and in their last frame.
    artifacts(index) : what is left out of a frame of an open take.
    kind : of the take, one of `openness.KINDS`.  take : what its frames have in common where it is not closed, None where it is: the
    surface is then without what depth cameras add to it, and the body is a layer or a shell, of which all else counts as a cap.
    keys : of each frame, from the bytes of its file.  counts : of its triangles.  boxes : (F, 2, 3) their lowest and highest
    corners.  diagonals : (F,) of the boxes, scene units.  statistics : of each frame as it came.
    large_pieces : of each frame, how many may be bodies.
    bad : frames in which something is lost or doubled for a moment; none where the take is not closed, as what is seen changes then.
    """

    def __init__(self, sequence: Sequence, captured: CapturedSequence, requested: str = "auto"):
        self.sequence, self._files = sequence, captured.files
        self.keys = [captured.keys[index] for index in range(len(sequence.frames))]
        survey = _Survey()
        shown = visits(survey.pieces(captured))
        bad = survey.bad_frames.finished()
        self.counts, self.inside_out, self.statistics = survey.counts, survey.inside_out, survey.statistics
        self.large_pieces = survey.large_pieces
        self.boxes = np.array(survey.boxes)
        self.diagonals = np.linalg.norm(self.boxes[:, 1] - self.boxes[:, 0], axis=1)
        self.mesh = lru_cache(maxsize=FRAMES_IN_MEMORY)(self._load)
        self.kind = take_kind([surface_kind(one.capped, one.compactness, one.of_pieces) for one in self.statistics], requested)
        self.take = open_take(self.kind, list(zip(survey.facing, survey.statistics, strict=True))) if self.kind != CLOSED else None
        self.bad = bad if self.take is None else ()
        # Of open takes, artifacts are left out first; which of their surfaces a frame shows is known by vertex.
        by_index = lambda rows: {index: pieces for index, pieces in enumerate(rows) if len(pieces) and self.take is None}
        self.transients, self.coming, self.leaving = (by_index(rows) for rows in (shown.transient, shown.coming, shown.leaving))
        for index, pieces in self.transients.items():
            self.keys[index] = digest(self.keys[index], pieces.tolist())
        if self.take is not None:
            # With the frames around each, which tell what lasts.
            around = [self.keys[max(index - WINDOW, 0) : index + WINDOW + 1] for index in range(len(self.keys))]
            self.keys = [digest(OPEN_SCHEMA, key, self.take.facts_of(index), around[index]) for index, key in enumerate(self.keys)]
        self._artifacts_alone = lru_cache(maxsize=FRAMES_IN_MEMORY)(lambda index: depth_artifacts(self.mesh(index)))
        self._possible_surface = lru_cache(maxsize=2 * WINDOW + 1)(
            lambda index: possible_surface(self.mesh(index), self._artifacts_alone(index))
        )
        self.artifacts = lru_cache(maxsize=FRAMES_IN_MEMORY)(self._artifacts)
        self.surface = lru_cache(maxsize=FRAMES_IN_MEMORY)(self._surface)
        self.capped = lru_cache(maxsize=FRAMES_IN_MEMORY)(self._capped)

    def __len__(self) -> int:
        return len(self.keys)

    @property
    def diagonal(self) -> float:
        """Of the box around the whole sequence, scene units."""
        return float(np.linalg.norm(self.boxes[:, 1].max(axis=0) - self.boxes[:, 0].min(axis=0)))

    @property
    def offset(self) -> np.ndarray:
        """(3,) about which positions are stored in single precision, by the first frame; zeros near the origin."""
        return storage_offset(*self.boxes[0])

    def body(self, index: int) -> TriangleMesh:
        """The surface with its holes capped."""
        return self.capped(index).mesh

    def transient(self, index: int) -> TriangleMesh:
        """The transient pieces of a frame in `transients`."""
        return self._only(index, self.transients)

    def arrival(self, index: int) -> TriangleMesh:
        """The pieces of a frame in `coming`, closed."""
        return smoothly_capped(self._only(index, self.coming)).mesh

    def departure(self, index: int) -> TriangleMesh:
        """The pieces of a frame in `leaving`, closed."""
        return smoothly_capped(self._only(index, self.leaving)).mesh

    def settled(self, index: int) -> TriangleMesh:
        """The body of a frame without what comes in it."""
        return smoothly_capped(self._without(index, self.transients, self.coming)).mesh if index in self.coming else self.body(index)

    def path(self, index: int) -> Path:
        """The file of a frame."""
        return self.sequence.frames[index].path

    def _surface(self, index: int) -> TriangleMesh:
        if self.take is None:
            return self._without(index, self.transients)
        return self.take.surface(self.mesh(index), self.artifacts(index), index)

    def _artifacts(self, index: int) -> Artifacts:
        others = (other for other in range(index - WINDOW, index + WINDOW + 1) if other != index and 0 <= other < len(self))
        around = ((other - index, self._possible_surface(other)) for other in others)
        return with_lasting_pieces(self.mesh(index), self._artifacts_alone(index), self._possible_surface(index), around)

    def _only(self, index: int, kind: Mapping[int, np.ndarray]) -> TriangleMesh:
        surface, chosen = self._chosen(index, kind)
        return submesh(surface, chosen)[0]

    def _without(self, index: int, *kinds: Mapping[int, np.ndarray]) -> TriangleMesh:
        if not any(index in kind for kind in kinds):
            return without_floaters(self.mesh(index))
        surface, chosen = self._chosen(index, *kinds)
        return submesh(surface, ~chosen)[0]

    def _chosen(self, index: int, *kinds: Mapping[int, np.ndarray]) -> tuple[TriangleMesh, np.ndarray]:
        """The surface without floaters, and (T,) bool, its triangles of pieces of certain kinds."""
        surface = without_floaters(self.mesh(index))
        piece = vertex_components(surface)[1][surface.triangles[:, 0]]
        return surface, np.isin(piece, np.concatenate([kind[index] for kind in kinds if index in kind]))

    def _capped(self, index: int) -> CappedMesh:
        surface = self.surface(index)
        if self.take is None:
            return smoothly_capped(surface)
        body = self.take.body(surface, index)
        return CappedMesh(body, np.where(np.arange(len(body.triangles)) < len(surface.triangles), -1, 0).astype(np.int32))

    def _load(self, index: int) -> TriangleMesh:
        try:
            return self._files[index].captured.mesh
        except RefMeshError as error:
            raise RefMeshError(f"{self.path(index)}: its cached copy disappeared during the run; start the run again") from error

    def check_scales(self) -> None:
        """Raises RefMeshError, naming the file, for a frame that is not of the size of the others."""
        usual = float(np.median(self.diagonals))
        jump = np.maximum(self.diagonals / usual, usual / np.maximum(self.diagonals, np.finfo(float).tiny))
        worst = int(np.argmax(jump))
        if jump[worst] > LARGEST_SCALE_JUMP:
            raise RefMeshError(
                f"{self.path(worst)}: its bounding box is {self.diagonals[worst]:.4g} across where the others have about {usual:.4g}; "
                "export all frames in one unit, or leave it out with --frames"
            )


def read_frames(
    session: Session, sequence: Sequence, share: StageShare, warn: Callable[[str], None], settings: TrackingSettings
) -> tuple[Frames, tuple[BadFrame, ...]]:
    """The frames of a sequence, without bad ones unless these are to be fitted as well, and the bad ones that were left out.

    Warns of those that were inside out, and says once what kind of capture it is unless it is closed. Raises RefMeshError, after
    all frames have been read, for those that cannot be used.
    """
    captured, requested = _usable_frames(session, sequence, share), settings.surface
    frames, bad = Frames(sequence, captured, requested), ()
    if frames.bad and settings.bad_frames != "fit":
        bad = frames.bad
        kept = np.setdiff1d(np.arange(len(frames)), [one.index for one in bad]).tolist()
        frames = Frames(replace(sequence, frames=tuple(sequence.frames[index] for index in kept)), captured.only(kept), requested)
    frames.check_scales()
    _warn_of_inside_out(frames, warn)
    _warn_of_strays(frames, warn)
    if frames.take is None:
        _warn_of_open_frames(frames, warn)
    else:
        warn(f"{sequence.name}: the take shows {DESCRIPTIONS[frames.kind]} (--surface {requested})")
    return frames, bad


def _usable_frames(session: Session, sequence: Sequence, share: StageShare) -> CapturedSequence:
    """All frames. Raises RefMeshError for those that cannot be used, once all have been read; in a task of a farm, all of its own."""
    unusable: dict[int, RefMeshError] = {}
    try:
        captured = capture_sequence(session, sequence, share, unusable.__setitem__)
    except PartDone:
        if unusable:
            raise unusable_frames(unusable, sequence) from None
        raise
    if unusable:
        raise unusable_frames(unusable, sequence)
    return captured


def _warn_of_inside_out(frames: Frames, warn: Callable[[str], None]) -> None:
    """One warning for all frames with a body that is inside out; with the file where it is one."""
    inside_out = [index for index, turned in enumerate(frames.inside_out) if turned]
    if len(inside_out) == 1:
        warn(f"{frames.path(inside_out[0])}: a body is inside out; its triangles are flipped")
    elif inside_out:
        numbers = frames.sequence.numbers
        which = format_frames((numbers[index] for index in inside_out), numbers)
        warn(f"{frames.sequence.name}: a body is inside out in {which}; its triangles are flipped")


def _warn_of_strays(frames: Frames, warn: Callable[[str], None]) -> None:
    """One warning for all frames with stray triangles, at the first."""
    affected = [index for index, one in enumerate(frames.statistics) if one.strays]
    if affected:
        first = frames.statistics[affected[0]]
        more = f" (and in {len(affected) - 1} more of {len(frames)} frames)" if len(affected) > 1 else ""
        warn(f"{frames.path(affected[0])}: {stray_note(first.strays, first.stray_place)}{more}")


def _warn_of_open_frames(frames: Frames, warn: Callable[[str], None]) -> None:
    """One warning for all frames without volume, at the worst."""
    numbers = frames.sequence.numbers
    open_frames = [index for index, one in enumerate(frames.statistics) if openness(one.capped, one.compactness)]
    if open_frames:
        worst = max(open_frames, key=lambda index: (frames.statistics[index].capped, -frames.statistics[index].compactness))
        reason = openness(frames.statistics[worst].capped, frames.statistics[worst].compactness)
        affected = [numbers[index] for index in open_frames]
        ranges, options = format_ranges(affected, numbers), f"--frames {format_selection(affected, numbers)} --surface open"
        alone = f"; as a take of their own ({options}) they stay open" if len(open_frames) < len(numbers) else ""
        warn(f"frame {numbers[worst]}: {reason} ({len(open_frames)} of {len(numbers)} frames: {ranges}{alone})")
