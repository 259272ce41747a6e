"""The tracking in the output folder: figures in the report, warnings, centers.npz and the playback of the centers."""

from __future__ import annotations

import numpy as np

from ...core.findings import CENTER_LAYOUTS
from ...core.tracking.center_attributes import center_attributes
from ...io.files import CENTERS_NAME, output_folder, write_npz
from ...io.frame_range import format_others
from ...io.pc2 import write_pc2
from ..session.cache import KEY_LENGTH, digest
from ..session.context import Context
from .tracking_result import TrackedFrames, TrackingResult

OUTSIDE_SHARE = 0.02  # of the centers; a few always lie in the hollow of a bent part
CENTER_ATTRIBUTES_SCHEMA = 1


def report_tracking(context: Context, frames: TrackedFrames, spacing: float) -> None:
    """Puts the figures of all frames into the report and warns of doubtful frames."""
    for name in ("dfu", "lloyd_energy", "arap_energy"):
        context.report.tracking[name] = getattr(frames, name).tolist()
    context.report.tracking["center_spacing"] = spacing
    born, retired = frames.born.tolist(), frames.retired.tolist()
    context.report.tracking |= {name: counts for name, counts in (("born", born), ("retired", retired)) if any(counts)}
    if context.frames.take is not None:
        return  # centers out of view lie outside, and come and go with what the camera sees
    jumps = frames.volume_jumps()
    for index, number in enumerate(context.numbers):
        if born[index] or retired[index]:
            came = [f"a body has appeared: {born[index]} centers are born for it"] if born[index] else []
            left = [f"a body is missing: its {retired[index]} centers are retired"] if retired[index] else []
            context.warn(f"frame {number}: {'; '.join(came + left)}")
        elif index in jumps:
            _warn_of_jump(context, number, jumps[index])
    _warn_of_outside(context, dict(zip(context.numbers, frames.outside.tolist(), strict=True)))


def _warn_of_outside(context: Context, shares: dict[int, float]) -> None:
    """One warning for all frames, at the worst.  shares : number of a frame -> of its centers, those that lie outside the surface."""
    beyond = {number: share for number, share in shares.items() if share > OUTSIDE_SHARE}
    if beyond:
        worst = max(beyond, key=lambda number: beyond[number])
        others = format_others(beyond, context.numbers, f"more than {OUTSIDE_SHARE:.0%}")
        what = f"{beyond[worst]:.1%} of the centers lie outside the surface{others}"
        context.warn(f"frame {worst}: {what}; a higher --centers follows thin parts better")


def _warn_of_jump(context: Context, number: int, jump: float) -> None:
    more, what = ("more", "appeared") if jump > 0 else ("less", "is missing")
    change = f"encloses {abs(jump):.0%} {more} volume than the frame before"
    context.warn(f"frame {number}: {change}: something {what}, and centers move to even that out")


def write_tracking(context: Context, tracking: TrackingResult) -> None:
    """centers.npz and the playback of the centers."""
    write_centers(context, tracking, {}, tracking.moving)
    _write_playback(context, tracking.positions, digest(*(one.key for one in tracking.ranges)))


def write_centers(
    context: Context, tracking: TrackingResult, reference_centers: dict[str, np.ndarray], bodies: np.ndarray | None = None
) -> None:
    """centers.npz: positions, the attributes by which a person judges them, and the arrays of the groups where they are known.

    bodies : (C,) that must be apart, or None.
    """
    spacing = tracking.ranges[0].spacing
    entry, marked = ("tracking/figures", []) if bodies is None else ("reference/figures", bodies.tolist())
    key = digest(CENTER_ATTRIBUTES_SCHEMA, [one.key for one in tracking.ranges], marked)
    attributes = context.cache.load_or_make(entry, key, lambda: center_attributes(tracking.positions, spacing, bodies), CENTER_LAYOUTS)
    centers = {"frames": np.array(context.numbers), "positions": tracking.positions}
    write_npz(context.claim(CENTERS_NAME), {**centers, **attributes, **reference_centers})


def _write_playback(context: Context, positions: np.ndarray, key: str) -> None:
    output_folder(context.output / "playback")
    path = f"playback/centers-{key[:KEY_LENGTH]}.pc2"
    shown = context.shown
    write_pc2(context.claim(path), (positions[index] for index in shown), positions.shape[1], len(shown), context.frames.offset)
    context.report.centers_playback = path
    context.remove_stale("playback/centers-*.pc2", keep=[path])
