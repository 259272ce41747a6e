"""The bodies of a take, as gaps and motion show them. Those that touch at first and move apart are followed anew, each by itself."""

from __future__ import annotations

import numpy as np

from ...core.reference.bodies_by_motion import TakeBodies, bodies_by_motion, touching_bodies
from ...core.reference.separation import bodies_of
from ...io.report import BodyReport
from ..session.cache import digest
from ..session.context import Context
from .tracking_result import TrackingResult

BODIES_SCHEMA = 2


def take_bodies(context: Context, tracking: TrackingResult) -> TakeBodies | None:
    """The bodies of a take that was tracked as a whole.

    None for an open take: what one camera sees changes without any motion.
    """
    if context.frames.take is not None:
        return None
    (whole,) = tracking.ranges
    return context.cache.load_or_make_result("tracking/bodies", digest(BODIES_SCHEMA, whole.key), TakeBodies, lambda: _bodies(tracking))


def _bodies(tracking: TrackingResult) -> TakeBodies:
    (whole,) = tracking.ranges
    known = bodies_of(tracking.positions[0], whole.load_affinity())
    # Centers that are born have no place in the first frame.
    start = touching_bodies(tracking.positions[0], whole.spacing) if tracking.active is None else None
    return bodies_by_motion(tracking.positions, whole.spacing, known, start)


def report_bodies(context: Context, tracking: TrackingResult, found: TakeBodies) -> None:
    """Every body in the report, and a warning where motion shows any."""
    for body, (first, last) in enumerate(found.rows.tolist()):
        own = found.bodies == body
        frames = (context.numbers[first], context.numbers[last]) if first >= 0 else ()
        middle = tuple(tracking.positions[max(first, 0), own].mean(axis=0).tolist())
        context.report.bodies.append(BodyReport(int(own.sum()), middle, frames, bool(found.by_motion[body])))
    if found.by_motion.any():
        first, last = context.report.bodies[int(np.argmax(found.by_motion))].frames
        what = f"{found.by_motion.sum()} bodies touch in the first frame, but move apart in frames {first}-{last}"
        context.warn(f"{what}: they are followed and reconstructed each by itself")
