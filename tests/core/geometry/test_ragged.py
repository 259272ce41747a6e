"""Ragged arrays: every entry knows its row and column, empty rows included, and entries are grouped by label."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.core.geometry.ragged import ragged_indices, sorted_by_label


def test_entries_know_their_row_and_column():
    lengths = np.random.default_rng(0).integers(0, 5, 200)
    rows, columns = ragged_indices(lengths)
    expected = [(row, column) for row, length in enumerate(lengths) for column in range(length)]
    assert_array_equal(np.stack([rows, columns], axis=1), expected)


def test_nothing_gives_nothing():
    for lengths in ([], [0, 0]):
        assert all(len(part) == 0 for part in ragged_indices(np.array(lengths, dtype=np.int64)))


@pytest.mark.parametrize("labels", [np.random.default_rng(3).integers(0, 9, 500), np.array([4]), np.zeros(0, dtype=np.int64)])
def test_a_counting_sort_is_a_stable_argsort(labels):
    order, starts = sorted_by_label(labels, 11)
    assert_array_equal(order, np.argsort(labels, kind="stable"))
    assert_array_equal(np.diff(starts), np.bincount(labels, minlength=11))
    assert starts[0] == 0


@pytest.mark.parametrize("labels", [[0, 3], [-1, 0]])
def test_labels_out_of_range_are_refused(labels):
    with pytest.raises(ValueError, match="labels must be 0 to 2"):
        sorted_by_label(np.array(labels), 3)
