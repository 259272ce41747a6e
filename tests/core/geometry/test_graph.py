"""Connected components are those of a plain flood fill, labeled in the order of their lowest nodes."""

import numpy as np
import pytest

from refmesh_addon.core.geometry.graph import connected_components


def flood_fill(edges, count):
    labels, number = np.full(count, -1), 0
    for node in range(count):
        if labels[node] < 0:
            front = {node}
            while front:
                labels[list(front)] = number
                front = {end for pair in edges for end in pair if set(pair) & front and labels[end] < 0}
            number += 1
    return number, labels.tolist()


@pytest.mark.parametrize("density", [0, 10, 25, 400])
def test_same_as_a_flood_fill(density):
    edges = np.random.default_rng(density).integers(0, 30, (density, 2))
    number, labels = connected_components(edges, 30)
    assert (number, labels.tolist()) == flood_fill(edges.tolist(), 30)
