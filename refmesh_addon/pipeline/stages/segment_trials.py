"""What the review of segments tries: meshes of runs, of some frames of a run, and of groups, in single frames."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...core.evaluation.segment_limits import FrameFigures
from ...core.reference.grouping import frame_stress, least_strained_cut
from ..session.context import Context
from .groups import chosen_groups
from .probes import probe
from .reference import GroupedFrames, References, group_frames, make_references
from .segments import in_folders
from .tracking_result import TrackingResult

PROBED_SHARE = 8  # a run has one probe for so many frames
LEAST_PROBES = 2
SKETCHED = 20  # frames that a sketch is made from beside its probes, at most
SHORTEST_VIEW = 2  # frames of an open take that have a mesh: one alone would be its own mesh

Run = tuple[int, ...]  # indices of consecutive frames


class SegmentTrials:
    """Built once for a take.  bodies : (C,) that must be apart, or None."""

    def __init__(self, context: Context, tracking: TrackingResult, bodies: np.ndarray | None):
        self._context, self._tracking, self._bodies = context.without_progress(), tracking, bodies
        self._groups = chosen_groups(context, tracking)

    def groups_within(self, run: Run) -> list[Run]:
        """The groups of the method, as far as they lie within a run. Of an open take, a run of one group may be divided further.

        What one camera sees changes faster than bodies deform: an arm that passes hides half of a chest within a frame or two.
        """
        members = set(run)
        groups = [inside for group in self._groups if (inside := tuple(frame for frame in group if frame in members))]
        if len(groups) > 1 or len(run) < 2 * SHORTEST_VIEW or self._context.frames.take is None:
            return groups
        cut = self._least_strained(run, range(SHORTEST_VIEW, len(run) - SHORTEST_VIEW + 1))
        return [run[:cut], run[cut:]]

    def best_cut(self, run: Run) -> int:
        """Where a run is cut that serves not even its first group: its reference positions suit neither part."""
        return run[self._least_strained(run, [group[0] - run[0] for group in self.groups_within(run)[1:]])]

    def probes(self, run: Run) -> tuple[int, ...]:
        """The frame of each group within a run in which centers are strained most; those of the most strained groups."""
        positions, affinity = self._tracking.centers_in(run), self._tracking.affinity_at(run)
        stress = dict(zip(run, frame_stress(positions, affinity).tolist(), strict=True))
        worst = [max(group, key=lambda frame: stress[frame]) for group in self.groups_within(run)]
        most = max(LEAST_PROBES, -(-len(run) // PROBED_SHARE))
        return tuple(sorted(sorted(worst, key=lambda frame: -stress[frame])[:most]))

    def sketches(self, runs: Mapping[int, Run]) -> References:
        """Meshes of some frames of each run, evenly chosen, and its probes; all of them of a short one."""
        probes = [self.probes(run) for run in runs.values()]
        even = [{run[row] for row in np.linspace(0, len(run) - 1, SKETCHED).astype(int).tolist()} for run in runs.values()]
        return self._references(probes, [tuple(sorted(chosen.union(own))) for chosen, own in zip(even, probes, strict=True)])

    def figures(self, references: References, frames: Mapping[int, tuple[int, ...]]) -> dict[int, FrameFigures]:
        """Of some frames of each group, by index of the frame.  frames : by index of the group."""
        return probe(self._context, self._tracking, references, frames)

    def own_figures(self, group: Run, *frames: int) -> dict[int, FrameFigures]:
        """Of some frames, by index, with a mesh for their group alone."""
        return self.figures(self._references([group], [group]), {0: frames})

    def _references(self, runs: list[Run], sources: list[Run]) -> References:
        grouped = in_folders(self._context, group_frames(self._context, self._tracking, self._bodies, runs, sources, segment=True))
        alone = tuple(replace(group, handover=None) for group in grouped.groups)
        return make_references(self._context, self._tracking, GroupedFrames(alone, self._bodies))

    def _least_strained(self, run: Run, candidates: range | list[int]) -> int:
        return least_strained_cut(self._tracking.centers_in(run), self._tracking.affinity_at(run), list(candidates))
