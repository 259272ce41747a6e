"""Sizes that captures come in, and the factor that makes a person of them."""

import pytest

from refmesh_addon.core.capture.scale import scale_note, scale_suggestion


@pytest.mark.parametrize(
    "longest, factor", [(18.7, 0.1), (1750.0, 0.001), (175.0, 0.01), (69.0, 0.0254), (5.8, 0.3048), (0.017, 100.0), (1.7, 1.0), (0.0, 1.0)]
)
def test_the_factor_is_that_of_the_unit(longest, factor):
    assert scale_suggestion(longest) == factor
    assert bool(scale_note(longest)) == (factor != 1.0)


def test_the_note_says_both_sizes():
    assert scale_note(1769.4) == "1,770 m long: if this is a person, scale by 0.001, which makes it 1.77 m"
    assert scale_note(18.7) == "18.7 m long: if this is a person, scale by 0.1, which makes it 1.87 m"
