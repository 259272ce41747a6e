"""report.json: the results of a run, in the form that other tools read."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

from ..core.errors import RefMeshError
from ..core.evaluation.distances import Distances
from ..core.settings import Settings
from .files import write_json
from .regular_files import read_json
from .report_schema import check_report
from .sequence import Sequence
from .versions import versions

SCHEMA = 1  # raised when a key changes its meaning or goes; new keys do not raise it
REPORT_NAME = "report.json"
DEFORMED_FOLDER, TEXTURE_FOLDER, COLORED_FOLDER = "deformed", "texture", "colored"  # in the output folder


@dataclass(frozen=True)
class GroupReport:
    """One group of frames and its reference mesh.

    frames : numbers.  anchor : number.  reference, playback : paths relative to the output folder; playback is None until
    the group is deformed.  visibility : path of the picture that says which vertices each frame shows; None for closed takes.
    iou_before, iou_after : the worst frame's IoU with the anchor, before and after alignment;
    symmetric_bodies : middles of bodies of the mesh that are nearly rotationally symmetric, scene units: their spin does not show in the
    volume, so it is not followed.
    frame_iou_before, frame_iou_after : of each frame.  self_intersections : triangles that cross another one.
    layout : path of the texture layout, texture : of the steady texture; layout_source : "own", "xatlas_abf", "xatlas",
    "smart_uv_abf" or "projected"; layout_charts, layout_stretch (1 is none), layout_area : figures of the layout; all None without color.
    left_out : numbers of frames that do not count for the surface.  handover : from the next group's first deformed frame to
    this group's mesh deformed to that frame; None for the last group and until it is evaluated.  reason : why another mesh begins here.
    """

    index: int
    frames: tuple[int, ...]
    anchor: int
    reference: str
    triangles: int
    components: int
    watertight: bool
    stress: float
    iou_before: float
    iou_after: float
    frame_iou_before: tuple[float, ...]
    frame_iou_after: tuple[float, ...]
    self_intersections: int
    playback: str | None = None
    visibility: str | None = None
    left_out: tuple[int, ...] = ()
    handover: Distances | None = None
    layout: str | None = None
    layout_source: str | None = None
    texture: str | None = None
    layout_charts: int | None = None
    layout_stretch: float | None = None
    layout_area: float | None = None
    symmetric_bodies: tuple[tuple[float, ...], ...] = ()
    reason: str | None = None


@dataclass(frozen=True)
class DriftReport:
    """Drift of a frame that was removed by color.

    agreeing : share of vertices whose picture agrees with that of the anchor frame once they have moved; 0 where the frame is as it was.
    slide : mean way that vertices have moved, mean edge lengths.
    distance_before, distance_after : mean of vertices from the source, but for what lies in a contact or over a hole, % of the diagonal.
    """

    agreeing: float
    slide: float
    distance_before: float
    distance_after: float


@dataclass(frozen=True)
class FrameReport:
    """One deformed frame; the distances are None until it is evaluated.

    deformed : path relative to the output folder.  flipped : share of triangles that face against their surroundings and against
    the source.  overstretched : share of the surface whose triangles are stretched far beyond the reference.
    capped : share of the frame's closed surface that closes holes by a guess.
    held : share of vertices that no point of the source pulled.  hidden : share of vertices that lie inside a contact.
    absent : share of vertices of bodies that the frame does not show at all; they are in one point of the surface.
    visible_to_source : from the deformed surface, but for what lies in a contact or over a hole of the source; `unseen` is its share.
    d1_psnr, d2_psnr : dB.  between : numbers of the frames that a bad frame moves between, or of the one that it holds.
    Of open takes only: kept : share of the captured surface that was kept.  skirts, flying, frayed : shares that were left out of it.
    border : distances between the borders of what was kept and of what is visible.
    texture, texture_mask : paths of the frame's picture and of the mask of what it shows of the capture; colored : path of the mesh with
    vertex colors; gain : of the exposure, per channel.  filled : share of the texels that other frames have filled.
    color_psnr, color_ssim : of unlit pictures against the source, dB; picture_psnr, picture_ssim : with outlines and background.
    drift : what was removed by color; None where that is off or where the take has no color.
    """

    number: int
    group: int
    deformed: str
    flipped: float = 0.0
    held: float = 0.0
    hidden: float = 0.0
    absent: float = 0.0
    overstretched: float = 0.0
    source_to_deformed: Distances | None = None
    deformed_to_source: Distances | None = None
    visible_to_source: Distances | None = None
    unseen: float | None = None
    between: tuple[int, ...] | None = None
    d1_psnr: float | None = None
    d2_psnr: float | None = None
    texture: str | None = None
    texture_mask: str | None = None
    colored: str | None = None
    gain: tuple[float, ...] | None = None
    filled: float | None = None
    drift: DriftReport | None = None
    color_psnr: float | None = None
    color_ssim: float | None = None
    picture_psnr: float | None = None
    picture_ssim: float | None = None
    capped: float | None = None
    kept: float | None = None
    skirts: float | None = None
    flying: float | None = None
    frayed: float | None = None
    border: Distances | None = None


@dataclass(frozen=True)
class FarPlace:
    """A place at which a deformed frame and its source are far apart.

    frame : number.  kind : "extra" where the result has surface that the source does not show, but for contacts and holes; "missing"
    where the source shows surface that the result does not have.  distance : largest there, share of the diagonal.
    position : of that point, in the coordinates of the input.  area : share of the frame's surface.
    """

    frame: int
    kind: str
    distance: float
    position: tuple[float, ...]
    area: float


@dataclass(frozen=True)
class BodyReport:
    """A body that is followed through the take.

    centers : how many it has.  position : their middle in the first of the frames that show it apart, in the coordinates of the input.
    frames : first and last number of those frames: the one with the widest gap, those with a narrow one, or those whose motion shows it;
    () where it is alone.
    by_motion : whether it is its motion that shows it.
    """

    centers: int
    position: tuple[float, ...]
    frames: tuple[int, ...]
    by_motion: bool


@dataclass(frozen=True)
class BadFrameReport:
    """A frame in which something is lost, doubled or leaps away for a moment, and which is not fitted.

    frame : number.  reason : what is wrong with it.  position : about where, in the coordinates of the input.
    before, after : numbers of the frames around that agree.  bridged : whether its mesh moves between these, or that before is held.
    """

    frame: int
    reason: str
    position: tuple[float, ...]
    before: int
    after: int
    bridged: bool


@dataclass(frozen=True)
class TransientReport:
    """Pieces of a frame that are there for a few frames only, and are not followed.

    frame : number.  count : of pieces.  position : their middle, in the coordinates of the input.  area : share of the frame's surface.
    shown : whether the deformed frame has them, as captured; otherwise they are left out.
    """

    frame: int
    count: int
    position: tuple[float, ...]
    area: float
    shown: bool


ENTRIES = {"groups": GroupReport, "frames": FrameReport, "far_places": FarPlace, "bodies": BodyReport, "bad_frames": BadFrameReport}


@dataclass
class Report:
    """Filled stage by stage and written after each.

    seconds : stage -> time it took.  bbox_diagonal : of the whole sequence, scene units.  offset : what is missing
    in the positions of playback files, which are in single precision; all others are in the coordinates of the input.
    surface : what kind of capture the take is: closed, layer or open.
    tracking : figures of the volume tracking.  centers_playback : path relative to the output folder.
    far_places : the worst first.
    """

    input: str
    sequence: Sequence
    settings: Settings
    bbox_diagonal: float = 0.0
    offset: tuple[float, ...] = (0.0, 0.0, 0.0)
    surface: str = "closed"
    centers_playback: str | None = None
    seconds: dict[str, float] = field(default_factory=dict)
    tracking: dict[str, object] = field(default_factory=dict)
    groups: list[GroupReport] = field(default_factory=list)
    frames: list[FrameReport] = field(default_factory=list)
    bodies: list[BodyReport] = field(default_factory=list)
    far_places: list[FarPlace] = field(default_factory=list)
    transients: list[TransientReport] = field(default_factory=list)
    bad_frames: list[BadFrameReport] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    def to_dict(self) -> dict[str, object]:
        """The report as JSON holds it."""
        return {
            "schema": SCHEMA,
            "input": self.input,
            "sequence": _sequence_entry(self.sequence),
            "settings": self.settings.to_flat(),
            "versions": versions(),
            "seconds": {stage: round(seconds, 3) for stage, seconds in self.seconds.items()},
            "bbox_diagonal": self.bbox_diagonal,
            "offset": list(self.offset),
            "surface": self.surface,
            "centers_playback": self.centers_playback,
            "tracking": self.tracking,
            "groups": [_without_none(group) for group in self.groups],
            "frames": [_without_none(frame) for frame in self.frames],
            "bodies": [asdict(body) for body in self.bodies],
            "far_places": [asdict(place) for place in self.far_places],
            "transients": [asdict(entry) for entry in self.transients],
            "bad_frames": [asdict(entry) for entry in self.bad_frames],
            "warnings": self.warnings,
        }

    def write(self, output: str | Path) -> Path:
        """Writes report.json into the output folder and gives its path. Raises ValueError for a figure that is not finite."""
        path = Path(output) / REPORT_NAME
        write_json(path, self.to_dict())
        return path


def deformed_path(number: int) -> str:
    """The deformed mesh of a frame, by its number; relative to the output folder."""
    return f"{DEFORMED_FOLDER}/frame_{number:04d}.ply"


def read_report(output: str | Path) -> dict[str, object]:
    """The report of an output folder.

    Raises RefMeshError, naming the file, when it is missing, broken, of another schema, or names files elsewhere.
    """
    path = Path(output) / REPORT_NAME
    try:
        report = read_json(path)
        schema = report["schema"]
    except OSError as error:
        raise RefMeshError(f"{path}: no results there ({error.strerror or error}); run the steps first or choose another folder") from error
    except (ValueError, KeyError, TypeError) as error:
        raise RefMeshError(f"{path}: the report is damaged; run RefMesh on this folder again") from error
    if schema != SCHEMA:
        raise RefMeshError(f"{path}: written by another version of RefMesh (schema {schema}, not {SCHEMA}); run it on this folder again")
    try:
        check_report(report, path.parent, ENTRIES)
    except ValueError as error:
        raise RefMeshError(f"{path}: the report is damaged ({error}); run RefMesh on this folder again") from error
    return report


def stored_offset(report: dict) -> np.ndarray:
    """(3,) float64 about which the playback files of a report are stored."""
    return np.array(report.get("offset", (0.0, 0.0, 0.0)), dtype=np.float64)


def _sequence_entry(sequence: Sequence) -> dict[str, object]:
    files = [frame.path.relative_to(sequence.folder).as_posix() for frame in sequence.frames]
    return {"name": sequence.name, "numbers": list(sequence.numbers), "gaps": list(sequence.gaps), "files": files}


def _without_none(entry: GroupReport | FrameReport) -> dict[str, object]:
    return {name: value for name, value in asdict(entry).items() if value is not None}
