"""Limits of a segment: what passes them, and against what."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from refmesh_addon.core.evaluation.segment_limits import (
    FLIPPED_MORE,
    MEAN_FLOOR,
    MEAN_RATIO,
    OVERSTRETCHED_MORE,
    P99_RATIO,
    P99_RATIO_VIEW,
    UNSEEN_MORE,
    USUAL,
    FrameFigures,
    excess,
    frame_figures,
    passed_limits,
    usual_figures,
    worse_of,
)
from refmesh_addon.core.types import TriangleMesh

OWN = FrameFigures(mean=2e-4, p99=1e-3, flipped=1e-4, overstretched=0.02, unseen=0.1)
AT_THE_LIMITS = FrameFigures(
    mean=OWN.mean * MEAN_RATIO,
    p99=OWN.p99 * P99_RATIO_VIEW,
    flipped=OWN.flipped + FLIPPED_MORE,
    overstretched=OWN.overstretched + OVERSTRETCHED_MORE,
    unseen=OWN.unseen + UNSEEN_MORE,
)


def test_a_mesh_as_good_as_the_groups_own_passes_no_limit():
    assert passed_limits(OWN, OWN) == [] == passed_limits(AT_THE_LIMITS, OWN)


@pytest.mark.parametrize("name", ["mean", "p99", "flipped", "overstretched", "unseen"])
def test_each_limit_is_one_of_its_own_and_named_with_both_figures(name):
    worse = replace(OWN, **{name: 1.01 * getattr(AT_THE_LIMITS, name)})
    (text,) = passed_limits(worse, OWN)
    assert text.count("%") == 2 and " against " in text
    assert excess(worse, OWN) == pytest.approx(1.01) and excess(OWN, OWN) < 1


def test_distances_of_bodies_seen_all_round_may_be_farther_from_their_own():
    own = replace(OWN, unseen=0.0)
    assert passed_limits(replace(own, p99=own.p99 * P99_RATIO), own) == []
    assert passed_limits(replace(own, p99=1.01 * own.p99 * P99_RATIO), own) != []


def test_figures_of_a_body_that_was_only_moved_are_how_far_it_is_off():
    shape = trimesh.creation.icosphere(subdivisions=2)
    ball = TriangleMesh(np.asarray(shape.vertices), np.asarray(shape.faces))
    at = ball.vertices + [0.0, 0.0, 0.01 * ball.diagonal]
    figures = frame_figures(ball, at, 0.25, ball, 2000)
    assert 0.002 < figures.mean < 0.01 and figures.p99 <= 0.0101 and figures.flipped == 0.25 and figures.overstretched == 0
    assert frame_figures(ball, ball.vertices, 0.0, ball, 2000).p99 == pytest.approx(0.0, abs=1e-9)


def test_what_nobody_sees_is_never_too_far():
    assert passed_limits(FrameFigures(MEAN_FLOOR, 0.0, 0.0, 0.0), FrameFigures(1e-9, 0.0, 0.0, 0.0)) == []


def test_usual_is_the_median_but_not_that_of_a_run_that_is_bad_throughout():
    good = [FrameFigures(mean, 1e-4, 0.0, 0.0) for mean in (1e-5, 2e-5, 9e-3)]
    assert usual_figures(good) == FrameFigures(2e-5, 1e-4, 0.0, 0.0)
    assert usual_figures([FrameFigures(1.0, 1.0, 1.0, 1.0, 1.0)] * 3) == USUAL


def test_the_worse_of_two_is_so_in_each_figure():
    assert worse_of(OWN, USUAL) == worse_of(USUAL, OWN) == FrameFigures(2e-4, 1e-3, 1e-4, 0.02, USUAL.unseen)
