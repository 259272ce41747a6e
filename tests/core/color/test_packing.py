"""Charts are packed in a bounded number of attempts, however many there are and whatever their sizes."""

import numpy as np
import pytest

from refmesh_addon.core.color.projected_layout import _packed
from refmesh_addon.core.errors import RefMeshError


@pytest.mark.parametrize("count", [1, 1000, 70_000])
def test_any_number_of_charts_fits(count):
    rng = np.random.default_rng(0)
    owner = np.repeat(np.arange(count), 3)
    placed = _packed(rng.random((3 * count, 2)) * rng.random(count)[owner, None], owner)
    assert placed.min() >= 0 and placed.max() <= 1


def test_charts_that_cannot_be_packed_are_refused():
    with np.errstate(all="ignore"), pytest.raises(RefMeshError, match="cannot be packed"):
        _packed(np.zeros((6, 2)), np.repeat([0, 1], 3))
