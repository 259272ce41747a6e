from dataclasses import replace

import numpy as np
import pytest

from benchmarks.compression_codecs import CODECS, Take, deltas, ours
from benchmarks.rate_distortion import MeasuredFrame, mean_saving, psnr, rate_at
from refmesh_addon.io.refmesh_stream.writer import Quality
from tests.core import shapes
from tests.io.refmesh_stream.bodies import torus_groups

QUALITY = [60.0, 64.0, 68.0, 72.0]
RATES = [1.0, 1.7, 3.1, 6.0]


def test_half_the_rate_saves_half():
    assert mean_saving([rate / 2 for rate in RATES], QUALITY, RATES, QUALITY) == pytest.approx(-0.5)


def test_a_curve_saves_nothing_against_itself_and_curves_apart_are_not_compared():
    assert mean_saving(RATES, QUALITY, RATES, QUALITY) == pytest.approx(0.0)
    assert mean_saving(RATES, QUALITY, RATES, [quality + 30 for quality in QUALITY]) is None


def test_rates_are_told_where_a_curve_goes_only():
    assert rate_at(RATES, QUALITY, 64.0) == pytest.approx(1.7)
    assert rate_at(RATES, QUALITY, 80.0) is None


def test_a_setting_that_another_one_beats_does_not_bend_the_curve():
    assert rate_at([*RATES, 9.0], [*QUALITY, 66.0], 64.0) == pytest.approx(1.7)


def test_a_ball_that_grew_is_as_far_off_as_it_grew():
    squares = MeasuredFrame(shapes.ball(4), 20000, 0).squares(shapes.ball(4, 1.01))
    for way in (squares.source_to_decoded, squares.visible_to_source):
        assert np.sqrt(way[0]) == pytest.approx(0.01, rel=0.02)
        assert way[1] <= way[0]


def test_psnr_of_a_thousandth_is_60():
    assert psnr(1e-6, 1.0) == pytest.approx(60.0)


@pytest.mark.parametrize("codec, setting", [(deltas, 1e-3), (ours, Quality(1e-3))])
def test_codecs_give_back_what_they_were_given(codec, setting):
    if codec is ours:
        pytest.importorskip("constriction")
    size, decoded = codec(Take(torus_groups(), 4.0), setting)
    assert 100 < size < 50000
    for before, after in zip(torus_groups(), decoded):
        assert after.numbers == before.numbers and after.positions.shape == before.positions.shape
        assert np.abs(after.positions.mean(axis=1) - before.positions.mean(axis=1)).max() < 4e-3


def test_a_codec_whose_package_is_missing_is_left_out():
    assert CODECS["refmesh"].is_available
    assert not replace(CODECS["refmesh"], package="no_such_package").is_available
