"""Lists laid end to end: every entry knows its list and its place there, empty lists included."""

import numpy as np
from numpy.testing import assert_array_equal

from refmesh_addon.core.geometry.ragged import numbered


def test_entries_know_their_list_and_place():
    counts = np.random.default_rng(0).integers(0, 5, 200)
    owner, place = numbered(counts)
    expected = [(number, position) for number, count in enumerate(counts) for position in range(count)]
    assert_array_equal(np.stack([owner, place], axis=1), expected)


def test_nothing_gives_nothing():
    for counts in ([], [0, 0]):
        assert all(len(part) == 0 for part in numbered(np.array(counts, dtype=np.int64)))
