"""A UV map of the user's own: taken as it is, or refused with the reason."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from refmesh_addon.core.color.layout import measured
from refmesh_addon.core.color.own_layout import layout_of

from .painted import cube_sphere

MESH, LAYOUT = cube_sphere(6)


def test_a_map_is_kept_and_its_charts_stay_whole():
    layout = layout_of(LAYOUT.corners.astype(np.float32))
    assert_allclose(layout.corners, LAYOUT.corners, atol=1e-6)
    assert measured(MESH, layout).charts == 6


@pytest.mark.parametrize(
    "change, reason",
    [
        (lambda corners: corners * 2, "beyond the square"),
        (lambda corners: np.where(corners > 0.9, np.nan, corners), "not finite"),
        (lambda corners: corners * 0, "covers nothing"),
        (lambda corners: np.mod(corners * [3, 1], 1) / [3, 1], "overlaps"),
    ],
)
def test_maps_that_cannot_hold_all_colors_are_refused(change, reason):
    with pytest.raises(ValueError, match=reason):
        layout_of(change(LAYOUT.corners))
