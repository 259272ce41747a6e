"""Frames of an open take that see much the same share a run; where others come into view, another begins."""

import numpy as np

from refmesh_addon.pipeline.stages.groups import SEEN, similar_views
from refmesh_addon.pipeline.stages.tracking_result import TrackingResult


def tracked(active):
    """A take of which only the centers that each frame sees are known."""
    return TrackingResult(np.zeros((*active.shape, 3)), (), active=active, carried=True)


def test_a_view_that_stays_or_changes_little_is_one_run():
    active = np.ones((30, 100), dtype=bool)
    assert similar_views(tracked(active)) == [tuple(range(30))]
    active[:10, 90:], active[20:, :10] = False, False
    assert similar_views(tracked(active)) == [tuple(range(30))]


def test_a_view_that_moves_on_is_cut_as_late_as_each_frame_still_sees_enough():
    active = np.array([(np.arange(400) >= 5 * frame) & (np.arange(400) < 5 * frame + 100) for frame in range(60)])
    runs = similar_views(tracked(active))
    assert [frame for run in runs for frame in run] == list(range(60))
    shares = [active[list(run)].sum(axis=1).min() / active[list(run)].any(axis=0).sum() for run in runs]
    longer = [active[[*run, run[-1] + 1]].any(axis=0).sum() for run in runs[:-1]]
    assert min(shares) >= SEEN and min(longer) > 100 / SEEN
