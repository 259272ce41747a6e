"""Tracking group by group: each group starts anew, so groups need nothing of each other and share the cores.

A group is tracked one frame further, into the first of the next. There both know where the centers are, and those of the
next group take the numbers of those that they lie nearest to: a center keeps its number, and steps to its partner's place.
"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np
from scipy import sparse

from ...core.errors import RefMeshError
from ...core.settings import TrackingSettings
from ...core.tracking.forward import first_frame, next_frame
from ...core.tracking.renumbering import assignment
from ...core.types import TriangleMesh
from ..session.cache import Arrays, digest
from ..session.context import READING_SHARE, Context
from .groups import fixed_spans
from .tracking import TRACKING_SCHEMA, enclosed_volume
from .tracking_result import FRAME_FIGURES, Part, Tracked, frame_entry, report_tracking


def track_groups(context: Context) -> Tracked:
    """Tracks each group of frames by itself. Raises RefMeshError when global rounds, or groups by content, are asked for too."""
    settings = context.settings.tracking
    if settings.global_rounds:
        raise RefMeshError("--global-rounds optimises the whole sequence at once: leave it out, or track with --tracking sequence")
    frames = context.frames
    spans = fixed_spans(context)
    reaches = [range(span[0], min(span[-1] + 2, len(frames))) for span in spans]
    keys = [digest(TRACKING_SCHEMA, asdict(settings), [frames.keys[index] for index in reach]) for reach in reaches]
    found = [context.cache.load(_entry(group), key) for group, key in enumerate(keys)]
    waiting = [group for group, made in enumerate(found) if made is None]
    tasks = (([frames.body(i) for i in reaches[group]], [frames.path(i) for i in reaches[group]], settings) for group in waiting)
    done = context.workers.map(track_group, tasks, lambda: context.notify("tracking", None, READING_SHARE))
    for count, (task, made) in enumerate(done, 1):
        group = waiting[task]
        found[group] = made
        context.cache.save(_entry(group), keys[group], made)
        share = (len(keys) - len(waiting) + count) / len(keys)
        context.notify("tracking", context.numbers[spans[group][-1]], READING_SHARE + (1 - READING_SHARE) * share)
    return _joined(context, spans, found, keys)


def track_group(bodies: list[TriangleMesh], paths: list[Path], settings: TrackingSettings) -> Arrays:
    """Centers (F, C, 3) and figures (F,) of the frames of one group, and the pairs of its affinity."""
    state, entries = None, []
    for body, path in zip(bodies, paths, strict=True):
        volume = enclosed_volume(body, path, settings)
        state = next_frame(state, volume, settings) if state else first_frame(volume, settings)
        entries.append(frame_entry(state, volume, path))
    pairs = state.affinity.weights().tocoo()
    arrays = {name: np.stack([entry[name] for entry in entries]) for name in (*FRAME_FIGURES, "centers", "volume", "outside")}
    return arrays | {"row": pairs.row, "column": pairs.col, "value": pairs.data, "spacing": np.float64(state.affinity.spacing)}


def _joined(context: Context, spans: list[tuple[int, ...]], found: list[Arrays], keys: list[str]) -> Tracked:
    """The groups one after the other, with numbers of centers that go on; what a center steps by is reported."""
    positions, parts, entries, steps, beyond, key = [], [], [], [], None, ""
    for span, made, own_key in zip(spans, found, keys, strict=True):
        centers, spacing = made["centers"], float(made["spacing"])
        count = centers.shape[1]
        order = np.arange(count) if beyond is None else assignment(beyond, centers[0])
        if beyond is not None:
            apart = np.linalg.norm(centers[0][order] - beyond, axis=1)
            steps.append(float(np.sqrt(np.mean(apart**2)) / spacing))
        affinity = sparse.csr_matrix((made["value"], (made["row"], made["column"])), (count, count))[order][:, order].tocsr()
        key = digest(key, own_key)  # the numbers, and nothing else, depend on the groups before
        positions += list(centers[: len(span), order])
        entries += [{name: made[name][frame] for name in (*FRAME_FIGURES, "volume", "outside")} for frame in range(len(span))]
        beyond = centers[len(span), order] if len(centers) > len(span) else None
        parts.append(Part(span[-1] + 1, affinity, spacing, key, beyond))
    report_tracking(context, entries, parts[0].spacing)
    context.report.tracking["handover"] = steps
    return Tracked(np.stack(positions), tuple(parts))


def _entry(group: int) -> str:
    return f"tracking/group_{group:03d}"
