"""What may be wrong with the frames of a captured sequence, found before hours of work go into it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..findings import SEVERITIES, Finding
from ..geometry.borders import boundary_edges
from ..geometry.holes import capped
from ..geometry.mesh import merged, signed_volume, triangle_areas
from ..types import TriangleMesh
from .orientation import flipped_patches, inside_out_bodies, reoriented
from .seams import stitched

LARGEST_SCALE_JUMP = 5.0  # between a frame's bounding-box diagonal and the median; the pipeline refuses more
SCALE_JUMP = 1.5  # the same between a frame and its neighbors, where bodies come and go
COUNT_JUMP = 1.5  # ratio of vertex counts of a frame and its neighbors
VOLUME_JUMP = 1.25  # ratio of the enclosed volumes of a frame and its neighbors
TYPICAL_SPREADS = 6.0  # a jump also has to stand out by so many median deviations of the whole sequence
NEIGHBORS = 2  # frames before and after that a frame is compared with
OPEN = "{:d} edges are open; the holes are capped where volume counts"
INWARD_SHARE = 0.01  # of the surface that may face inward before it is worth a word


@dataclass(frozen=True)
class FrameFigures:
    """What is known of one frame; all but number and error are meaningless where it cannot be read.

    error : why it cannot be read, "" where it can.  content : equal for frames of equal content.
    diagonal : of the bounding box, scene units.  volume : enclosed with holes capped, scene units cubed.
    open_edges : edges with a triangle on one side only.  inward : share of the area that faces inward.
    missing_textures : files that the frame names and that are not there.
    """

    number: int
    error: str = ""
    content: str = ""
    vertices: int = 0
    diagonal: float = 0.0
    volume: float = 0.0
    open_edges: int = 0
    inward: float = 0.0
    missing_textures: tuple[str, ...] = ()


def examine(mesh: TriangleMesh) -> dict[str, float]:
    """The figures of `FrameFigures` that come from the mesh alone."""
    whole = stitched(merged(mesh)[0])
    areas = triangle_areas(whole)
    patches = flipped_patches(whole)
    agreed = reoriented(whole, patches)
    bodies = inside_out_bodies(agreed)
    return {
        "vertices": len(mesh.vertices),
        "diagonal": whole.diagonal,
        "volume": signed_volume(capped(reoriented(agreed, bodies))),
        "open_edges": len(boundary_edges(agreed)),
        "inward": float(areas[patches ^ bodies].sum() / areas.sum()),
    }


def diagnose(frames: Sequence[FrameFigures], gaps: Sequence[int] = ()) -> list[Finding]:
    """Findings about a sequence, the gravest first, then by frame; gaps : numbers that are missing.

    What most frames have in common is one finding at the frame that has most of it.
    """
    readable = [frame for frame in frames if not frame.error]
    found = [Finding("unreadable", "error", frame.number, frame.error) for frame in frames if frame.error]
    found += _duplicates(readable) + _gaps(frames, gaps) + _scales(readable)
    found += _jumps(readable, "vertex count", COUNT_JUMP, lambda frame: frame.vertices)
    found += _jumps(readable, "volume", VOLUME_JUMP, lambda frame: abs(frame.volume))
    found += _shared(readable, "holes", "note", lambda frame: frame.open_edges, OPEN)
    found += _shared(
        readable,
        "facing",
        "note",
        lambda frame: frame.inward if frame.inward > INWARD_SHARE else 0.0,
        "{:.0%} of the surface faces inward; it is turned round",
    )
    textures = "{:d} textures are missing: {names}"
    found += _shared(readable, "textures", "note", lambda frame: len(frame.missing_textures), textures)
    order = list(SEVERITIES)
    return sorted(found, key=lambda finding: (order.index(finding.severity), finding.frame))


def _duplicates(frames: Sequence[FrameFigures]) -> list[Finding]:
    first: dict[str, int] = {}
    found = []
    for frame in frames:
        same = first.setdefault(frame.content, frame.number)
        if same != frame.number:
            found.append(Finding("duplicate", "warning", frame.number, f"the same as frame {same}: motion stops here"))
    return found


def _gaps(frames: Sequence[FrameFigures], gaps: Sequence[int]) -> list[Finding]:
    numbers = np.array([frame.number for frame in frames])
    before = numbers[np.searchsorted(numbers, gaps) - 1] if len(gaps) else []
    found = []
    for number in np.unique(before):
        missing = [gap for gap, held in zip(gaps, before, strict=True) if held == number]
        words = f"frame {missing[0]} is" if len(missing) == 1 else f"frames {missing[0]} to {missing[-1]} are"
        found.append(Finding("gap", "warning", int(number), f"{words} missing after this one, which is held"))
    return found


def _scales(frames: Sequence[FrameFigures]) -> list[Finding]:
    """Frames in another unit, and smaller jumps from frame to frame."""
    if not frames:
        return []
    usual = float(np.median([frame.diagonal for frame in frames]))
    strange = [frame for frame in frames if not usual / LARGEST_SCALE_JUMP <= frame.diagonal <= usual * LARGEST_SCALE_JUMP]
    words = "{:.3g} times the usual size: export all frames in one unit, or leave it out"
    found = [Finding("scale", "error", frame.number, words.format(frame.diagonal / usual)) for frame in strange]
    return found + _jumps([frame for frame in frames if frame not in strange], "size", SCALE_JUMP, lambda frame: frame.diagonal)


def _jumps(frames: Sequence[FrameFigures], kind: str, least: float, figure: Callable[[FrameFigures], float]) -> list[Finding]:
    """Frames whose figure stands out from that of their neighbors and from how much it varies otherwise."""
    values = np.array([figure(frame) for frame in frames], dtype=float)
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


def _shared(
    frames: Sequence[FrameFigures], kind: str, severity: str, figure: Callable[[FrameFigures], float], words: str
) -> list[Finding]:
    affected = [frame for frame in frames if figure(frame) > 0]

    def said(frame: FrameFigures) -> str:
        return words.format(figure(frame), names=", ".join(frame.missing_textures[:3]))

    if 2 * len(affected) <= len(frames) or len(affected) < 3:
        return [Finding(kind, severity, frame.number, said(frame)) for frame in affected]
    worst = max(affected, key=figure)
    return [Finding(kind, severity, worst.number, f"{said(worst)}; so in {len(affected)} of {len(frames)} frames, most here")]
