"""Short runs are joined with their neighbors where one mesh serves both, and nowhere else."""

import numpy as np

from refmesh_addon.core.evaluation.segment_limits import FrameFigures
from refmesh_addon.pipeline.stages.segment_joining import SHORT, with_short_joined, worst_figures
from refmesh_addon.pipeline.stages.segments import FINAL, LONGEST_VIEW, Cuts

GOOD, BAD = FrameFigures(1e-4, 5e-4, 0.0, 0.0), FrameFigures(9e-4, 5e-3, 0.0, 0.0)


def joined(*lengths, figures=lambda run: GOOD, fixed=(), sources=None):
    """Lengths and reasons of runs after joining.  figures : those with a mesh for a run."""
    ends = np.cumsum(lengths).tolist()
    starts = [0, *ends[:-1]]
    cuts = Cuts.at({start: f"at {start}" for start in starts}, ends[-1], FINAL, spent=3)
    cuts = cuts if sources is None else Cuts(cuts.starts, cuts.reasons, np.array(sources), FINAL, 3)
    own = [{start: GOOD} for start in starts]
    cuts = with_short_joined(cuts, own, lambda run, *frames: dict.fromkeys(frames, figures(run)), fixed)
    assert (cuts.state, cuts.spent) == (FINAL, 3)
    return [len(run) for run in cuts.runs(ends[-1])], list(cuts.reasons)


def test_short_runs_are_joined_one_after_the_other_with_the_reason_of_the_first():
    assert joined(2, 3, 2) == ([7], ["at 0"])
    assert joined(SHORT + 5, 2, SHORT + 5) == ([SHORT + 7, SHORT + 5], ["at 0", f"at {SHORT + 7}"])


def test_long_ones_stay_apart_and_none_grows_beyond_the_longest():
    assert joined(SHORT, SHORT)[0] == [SHORT, SHORT]
    assert joined(LONGEST_VIEW - 2, 3)[0] == [LONGEST_VIEW - 2, 3]


def test_those_that_one_mesh_does_not_serve_stay_apart():
    assert joined(2, 3, 2, figures=lambda run: BAD)[0] == [2, 3, 2]
    assert joined(2, 3, 2, figures=lambda run: BAD if 0 in run else GOOD)[0] == [2, 5]


def test_a_run_around_another_and_one_after_bad_frames_stay():
    assert joined(2, 3, 2, sources=[(0, 7), (2, 5), (0, 7)])[0] == [2, 3, 2]
    assert joined(2, 3, 2, fixed=(2,))[0] == [2, 5]


def test_the_worst_frames_are_those_farthest_beyond_the_usual():
    figures = dict(enumerate([GOOD, BAD, GOOD, FrameFigures(1e-4, 5e-4, 0.0, 0.0, unseen=0.9)]))
    assert worst_figures(figures, (0, 1, 2, 3)) == {1: BAD, 3: figures[3]}
