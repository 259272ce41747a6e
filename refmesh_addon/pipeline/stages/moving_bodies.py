"""The bodies of a take, as gaps and motion show them. Those that touch at first and move apart are followed anew, each by itself."""

from __future__ import annotations

import numpy as np

from ...core.reference.bodies_by_gaps import GapBodies, bodies_by_gaps
from ...core.reference.bodies_by_motion import TakeBodies, bodies_by_motion, touching_bodies
from ...core.reference.separation import bodies_of
from ...io.report import BodyReport
from ..session.cache import digest
from ..session.context import Context
from .tracking_result import TrackingResult

BODIES_SCHEMA = 3


def take_bodies(context: Context, tracking: TrackingResult) -> TakeBodies | None:
    """The bodies of a take that was tracked as a whole.

    None for an open take: what one camera sees changes without any motion.
    """
    if context.frames.take is not None:
        return None
    (whole,) = tracking.ranges
    make = lambda: _bodies(context, tracking)
    return context.cache.load_or_make_result("tracking/bodies", digest(BODIES_SCHEMA, whole.key), TakeBodies, make)


def _bodies(context: Context, tracking: TrackingResult) -> TakeBodies:
    (whole,) = tracking.ranges
    known = bodies_of(tracking.positions[0], whole.load_affinity())
    if tracking.active is not None:  # centers that are born have no place in the first frame
        return bodies_by_motion(tracking.positions, whole.spacing, GapBodies.known(known))
    shown = np.flatnonzero(np.array(context.frames.large_pieces) > known.max() + 1).tolist()
    gaps = bodies_by_gaps(tracking.positions, whole.spacing, known, shown, context.frames.body)
    return bodies_by_motion(tracking.positions, whole.spacing, gaps, touching_bodies(tracking.positions[0], whole.spacing))


def report_bodies(context: Context, tracking: TrackingResult, found: TakeBodies) -> None:
    """Every body in the report, and a warning where those that touch are told apart."""
    for body, (first, last) in enumerate(found.rows.tolist()):
        own = found.bodies == body
        frames = (context.numbers[first], context.numbers[last]) if first >= 0 else ()
        middle = tuple(tracking.positions[max(first, 0), own].mean(axis=0).tolist())
        context.report.bodies.append(BodyReport(int(own.sum()), middle, frames, bool(found.by_motion[body])))
    _warn(context, found.by_motion, "touch in the first frame, but move apart in frames {}-{}")
    always = (found.rows == [0, len(context.numbers) - 1]).all(axis=1)
    _warn(context, found.joined & ~found.by_motion & ~always, "touch in other frames, but are apart in frames {}-{}")
    _warn(context, found.joined & ~found.by_motion & always, "have only a narrow gap between them in all frames, {}-{}")


def _warn(context: Context, chosen: np.ndarray, what: str) -> None:
    """What shows the (B,) bool chosen bodies, if any, and what is done about it."""
    if chosen.any():
        frames = context.report.bodies[int(np.argmax(chosen))].frames
        context.warn(f"{chosen.sum()} bodies {what.format(*frames)}: they are followed and reconstructed each by itself")
