"""Limits of a segment: what passes them, and against what."""

from dataclasses import replace

import pytest

from refmesh_addon.core.evaluation.segment_limits import (
    FLIPPED_MORE,
    MEAN_FLOOR,
    MEAN_RATIO,
    OVERSTRETCHED_MORE,
    P99_RATIO,
    USUAL,
    FrameFigures,
    passed_limits,
    usual_figures,
    worse_of,
)

OWN = FrameFigures(mean=2e-4, p99=1e-3, flipped=1e-4, overstretched=0.02)
AT_THE_LIMITS = FrameFigures(
    OWN.mean * MEAN_RATIO, OWN.p99 * P99_RATIO, OWN.flipped + FLIPPED_MORE, OWN.overstretched + OVERSTRETCHED_MORE
)


def test_a_mesh_as_good_as_the_groups_own_passes_no_limit():
    assert passed_limits(OWN, OWN) == [] == passed_limits(AT_THE_LIMITS, OWN)


@pytest.mark.parametrize("name", ["mean", "p99", "flipped", "overstretched"])
def test_each_limit_is_one_of_its_own_and_named_with_both_figures(name):
    worse = replace(OWN, **{name: 1.01 * getattr(AT_THE_LIMITS, name)})
    (text,) = passed_limits(worse, OWN)
    assert text.count("%") == 2 and " against " in text


def test_what_nobody_sees_is_never_too_far():
    assert passed_limits(FrameFigures(MEAN_FLOOR, 0.0, 0.0, 0.0), FrameFigures(1e-9, 0.0, 0.0, 0.0)) == []


def test_usual_is_the_median_but_not_that_of_a_run_that_is_bad_throughout():
    good = [FrameFigures(mean, 1e-4, 0.0, 0.0) for mean in (1e-5, 2e-5, 9e-3)]
    assert usual_figures(good) == FrameFigures(2e-5, 1e-4, 0.0, 0.0)
    assert usual_figures([FrameFigures(1.0, 1.0, 1.0, 1.0)] * 3) == USUAL


def test_the_worse_of_two_is_so_in_each_figure():
    assert worse_of(OWN, USUAL) == worse_of(USUAL, OWN) == FrameFigures(2e-4, 1e-3, 1e-4, 0.02)
