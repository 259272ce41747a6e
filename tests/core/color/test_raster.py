"""Scan conversion: every center once, right weights, and what a slow twin covers."""

import numpy as np
from numpy.testing import assert_allclose

from refmesh_addon.core.color.raster import rasterized

SIZE = 24


def slow_covered(corners):
    """Pixels whose centers are strictly inside, by the three edges' signs."""
    covered = set()
    for row in range(SIZE):
        for column in range(SIZE):
            p = np.array([column + 0.5, row + 0.5])
            signs = [np.cross(b - a, p - a) for a, b in zip(corners, np.roll(corners, -1, axis=0))]
            if min(signs) > 1e-9 or max(signs) < -1e-9:
                covered.add(row * SIZE + column)
    return covered


def test_covers_what_lies_inside():
    rng = np.random.default_rng(1)
    triangles = rng.uniform(-4, SIZE + 4, (40, 3, 2))
    fragments = rasterized(triangles, SIZE, SIZE)
    for index, corners in enumerate(triangles):
        assert set(fragments.pixels[fragments.triangles == index].tolist()) == slow_covered(corners)


def test_triangles_that_share_edges_cover_each_center_once():
    """Corners on centers and level edges, where rounding and ties decide."""
    rng = np.random.default_rng(2)
    grid = np.stack(np.meshgrid(np.arange(0, SIZE + 1, 4.0), np.arange(0, SIZE + 1, 4.0)), axis=-1)
    grid[1:-1, 1:-1] += np.round(rng.uniform(-1.5, 1.5, grid[1:-1, 1:-1].shape) * 2) / 2
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    triangles = np.concatenate([np.stack([a, b, c], axis=2).reshape(-1, 3, 2), np.stack([a, c, d], axis=2).reshape(-1, 3, 2)])
    fragments = rasterized(triangles, SIZE, SIZE)
    assert np.array_equal(np.sort(fragments.pixels), np.arange(SIZE * SIZE))


def test_weights_give_the_center_back():
    triangles = np.random.default_rng(3).uniform(0, SIZE, (30, 3, 2))
    fragments = rasterized(triangles, SIZE, SIZE)
    a, b, c = triangles[fragments.triangles].transpose(1, 0, 2)
    second, third = fragments.shares.T[:, :, None]
    row, column = np.divmod(fragments.pixels, SIZE)
    assert_allclose(a + second * (b - a) + third * (c - a), np.stack([column, row], axis=1) + 0.5, atol=1e-3)


def test_winding_does_not_matter():
    triangles = np.random.default_rng(4).uniform(0, SIZE, (20, 3, 2))
    forward, backward = (rasterized(order, SIZE, SIZE) for order in (triangles, triangles[:, ::-1]))
    assert np.array_equal(forward.pixels, backward.pixels)


def test_flat_triangles_and_none_cover_nothing():
    assert len(rasterized(np.array([[[1.0, 1.0], [9.0, 9.0], [5.0, 5.0]]]), SIZE, SIZE).pixels) == 0
    assert len(rasterized(np.empty((0, 3, 2)), SIZE, SIZE).pixels) == 0
