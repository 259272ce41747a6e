"""Checks of a captured sequence: what may be wrong with its frames, before hours of computation go into it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from ..counted import counted
from ..findings import SEVERITIES, Finding
from .openness import ADJECTIVES, CLOSED, DESCRIPTIONS, LARGEST_CAPPED, openness, surface_kind, take_kind
from .strays import stray_note

LARGEST_SCALE_JUMP = 5.0  # ratio of a frame's bounding-box diagonal to the median beyond which the pipeline refuses it
SCALE_JUMP = 1.5  # the same ratio to the frames around it, where bodies come and go
COUNT_JUMP = 1.5  # ratio of a frame's vertex count to that of the frames around it
VOLUME_JUMP = 1.25  # the same of its enclosed volume
TYPICAL_SPREADS = 6.0  # a jump also has to stand out by this many median deviations of the whole sequence
NEIGHBORS = 2  # frames before and after that a frame is compared with
LEAST_SHARED = 3  # frames with the same finding from which on one for all of them is enough
NAMED_TEXTURES = 3  # missing files that a message names
INWARD_SHARE = 0.01  # of the surface that may face inward before it is worth reporting


@dataclass(frozen=True)
class FrameStatistics:
    """What is known of one frame; where it cannot be read, only `number` and `error` mean anything.

    error : why it cannot be read, "" where it can.  content : equal for frames of equal content.
    vertices, diagonal, volume, open_edges, inward, capped, compactness, of_pieces, area, needed_triangles, rim_excess, strays,
    stray_place : see `MeshStatistics`.
    missing_textures : files that the frame refers to and that do not exist.
    omitted_faces : faces of the file that have fewer than three corners.
    """

    number: int
    error: str = ""
    content: str = ""
    vertices: int = 0
    diagonal: float = 0.0
    volume: float = 0.0
    open_edges: int = 0
    inward: float = 0.0
    capped: float = 0.0
    compactness: float = 1.0
    of_pieces: float = 1.0
    area: float = 0.0
    needed_triangles: int = 0
    rim_excess: float = 0.0
    strays: int = 0
    stray_place: tuple[float, ...] = ()
    missing_textures: tuple[str, ...] = ()
    omitted_faces: int = 0

    @property
    def kind(self) -> str:
        """One of `openness.KINDS`."""
        return surface_kind(self.capped, self.compactness, self.of_pieces)


# A number to judge a frame by: a jump from frame to frame, or above 0, is a finding.
Statistic = Callable[[FrameStatistics], float]


def diagnose(frames: Sequence[FrameStatistics], gaps: Sequence[int] = (), surface: str = "auto") -> list[Finding]:
    """Findings about a sequence, the most severe first, then by frame.  gaps : missing frame numbers.  surface : the setting.

    What most frames have in common is reported once, at the frame where it is worst.
    """
    readable = [frame for frame in frames if not frame.error]
    findings = [
        *(Finding("unreadable", "error", frame.number, frame.error) for frame in frames if frame.error),
        *_duplicates(readable),
        *_gaps(frames, gaps),
        *_scales(readable),
        *_jumps(readable, "vertex count", COUNT_JUMP, lambda frame: frame.vertices),
        *_jumps(readable, "volume", VOLUME_JUMP, lambda frame: abs(frame.volume)),
        *_surface(readable, surface),
        *_notes(readable, "holes", lambda frame: frame.open_edges, _holes),
        *_notes(readable, "facing", _inward, lambda frame: f"{_inward(frame):.0%} of the surface faces inward; it is flipped"),
        *_notes(readable, "strays", lambda frame: frame.strays, lambda frame: stray_note(frame.strays, frame.stray_place)),
        *_notes(readable, "faces", lambda frame: frame.omitted_faces, _omitted_faces),
        *_notes(readable, "textures", lambda frame: len(frame.missing_textures), _missing_textures),
    ]
    order = list(SEVERITIES)
    return sorted(findings, key=lambda finding: (order.index(finding.severity), finding.frame))


def describe_take(frames: Sequence[FrameStatistics], requested: str = "auto") -> str:
    """What kind of capture the take is, in a clause; "" where no frame can be read.  requested : the setting `surface`."""
    kinds = [frame.kind for frame in frames if not frame.error]
    kind = take_kind(kinds, requested)
    share = f"{kinds.count(kind)} of {len(kinds)} frames {'is' if kinds.count(kind) == 1 else 'are'} {ADJECTIVES[kind]}"
    return f"the take shows {DESCRIPTIONS[kind]} ({share})" if kinds else ""


def _surface(frames: Sequence[FrameStatistics], requested: str) -> list[Finding]:
    """What kind of capture the take is, unless it is closed, and frames of another kind; for closed takes, frames without volume."""
    kinds = [frame.kind for frame in frames]
    kind = take_kind(kinds, requested)
    if kind == CLOSED:
        return _open(frames)
    first, usual = frames[0].number if frames else 0, describe_take(frames, requested)
    others = [(frame.number, ADJECTIVES[own]) for frame, own in zip(frames, kinds, strict=True) if own != kind]
    return [Finding("surface", "note", first, usual)] + [
        Finding("surface", "note", number, f"is {own}, unlike the take as a whole; it is treated as the others") for number, own in others
    ]


def _open(frames: Sequence[FrameStatistics]) -> list[Finding]:
    """A warning for each frame without volume; for most frames, one for the whole take, at the worst."""
    reasons = {frame.number: openness(frame.capped, frame.compactness) for frame in frames}
    affected = [frame for frame in frames if reasons[frame.number]]
    if 2 * len(affected) <= len(frames) or len(affected) < LEAST_SHARED:
        return [Finding("open", "warning", frame.number, reasons[frame.number]) for frame in affected]
    worst = max(affected, key=lambda frame: (frame.capped > LARGEST_CAPPED, frame.capped, -frame.compactness))
    return [Finding("open", "warning", worst.number, reasons[worst.number] + _shared(affected, frames))]


def _shared(affected: Sequence[FrameStatistics], frames: Sequence[FrameStatistics]) -> str:
    """Follows what is said of the worst frame."""
    return f" (as in {len(affected)} of {len(frames)} frames; this one is the worst)"


def _inward(frame: FrameStatistics) -> float:
    return frame.inward if frame.inward > INWARD_SHARE else 0.0


def _duplicates(frames: Sequence[FrameStatistics]) -> list[Finding]:
    """Frames with the content of an earlier one: one finding for each run of frames with the same content, at the first of them."""
    first: dict[str, int] = {}
    findings = []
    for content, run in groupby(frames, lambda frame: frame.content):
        numbers = [frame.number for frame in run]
        same = first.setdefault(content, numbers[0])
        copies = numbers[same == numbers[0] :]
        if copies:
            more = f", as are the {len(copies) - 1} after it" if len(copies) > 2 else ", as is the next" if len(copies) == 2 else ""
            findings.append(Finding("duplicate", "warning", copies[0], f"identical to frame {same}{more}: motion stops here"))
    return findings


def _gaps(frames: Sequence[FrameStatistics], gaps: Sequence[int]) -> list[Finding]:
    """One finding for each run of missing frames, at the frame before it."""
    numbers = np.array([frame.number for frame in frames])
    before = numbers[np.searchsorted(numbers, gaps) - 1] if len(gaps) else []
    findings = []
    for number in np.unique(before):
        missing = [gap for gap, held in zip(gaps, before, strict=True) if held == number]
        subject = f"frame {missing[0]} is" if len(missing) == 1 else f"frames {missing[0]} to {missing[-1]} are"
        findings.append(Finding("gap", "warning", int(number), f"{subject} missing after this one, which is held"))
    return findings


def _scales(frames: Sequence[FrameStatistics]) -> list[Finding]:
    """Frames in another unit, and smaller changes of size from frame to frame."""
    if not frames:
        return []
    median = float(np.median([frame.diagonal for frame in frames]))
    usual = [frame for frame in frames if median / LARGEST_SCALE_JUMP <= frame.diagonal <= median * LARGEST_SCALE_JUMP]
    message = "{:.3g} times the usual size: export all frames in one unit, or leave this one out"
    findings = [Finding("scale", "error", frame.number, message.format(frame.diagonal / median)) for frame in frames if frame not in usual]
    return findings + _jumps(usual, "size", SCALE_JUMP, lambda frame: frame.diagonal)


def _jumps(frames: Sequence[FrameStatistics], kind: str, least: float, statistic: Statistic) -> list[Finding]:
    """Frames in which a statistic differs from that of the frames around them by more than it usually does, and by `least` as a ratio."""
    values = np.array([statistic(frame) for frame in frames], dtype=float)
    if len(values) < 3 or not (values > 0).all():
        return []
    padded = np.pad(np.log(values), NEIGHBORS, mode="reflect" if len(values) > NEIGHBORS else "edge")
    around = np.lib.stride_tricks.sliding_window_view(padded, 2 * NEIGHBORS + 1)
    deviation = np.log(values) - np.median(around, axis=1)
    limit = max(np.log(least), TYPICAL_SPREADS * float(np.median(np.abs(deviation))))
    return [
        Finding(kind, "warning", frames[index].number, f"{kind} is {np.exp(deviation[index]):.2f} times that of the frames around it")
        for index in np.flatnonzero(np.abs(deviation) > limit)
    ]


def _holes(frame: FrameStatistics) -> str:
    return f"{counted(frame.open_edges, 'open edge')}; holes are capped where a closed volume is needed"


def _omitted_faces(frame: FrameStatistics) -> str:
    return f"{counted(frame.omitted_faces, 'degenerate face')} with fewer than three corners left out"


def _missing_textures(frame: FrameStatistics) -> str:
    return f"{counted(len(frame.missing_textures), 'missing texture')}: {', '.join(frame.missing_textures[:NAMED_TEXTURES])}"


def _notes(
    frames: Sequence[FrameStatistics], kind: str, statistic: Statistic, message: Callable[[FrameStatistics], str]
) -> list[Finding]:
    """A note for each frame in which a statistic is above 0; for most frames, one at the worst."""
    affected = [frame for frame in frames if statistic(frame) > 0]
    if 2 * len(affected) <= len(frames) or len(affected) < LEAST_SHARED:
        return [Finding(kind, "note", frame.number, message(frame)) for frame in affected]
    worst = max(affected, key=statistic)
    return [Finding(kind, "note", worst.number, message(worst) + _shared(affected, frames))]
