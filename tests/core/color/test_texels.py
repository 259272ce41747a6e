"""Texels of a layout: all that are covered, their places, their seeds and their gutters."""

import numpy as np
from numpy.testing import assert_allclose

from refmesh_addon.core.color.raster import rasterized
from refmesh_addon.core.color.texels import STRIDE, Texels

from .painted import cube_sphere

SIZE = 96
MESH, LAYOUT = cube_sphere(5)
TEXELS = Texels.of(LAYOUT, SIZE)


def test_every_pixel_is_a_texel_or_gutter():
    assert np.array_equal(np.sort(np.concatenate([TEXELS.pixels, TEXELS.gutter])), np.arange(SIZE * SIZE))


def test_texels_are_where_their_pixels_are_in_the_layout():
    uvs = LAYOUT.corners[TEXELS.triangles]
    place = uvs[:, 0] + TEXELS.shares[:, :1] * (uvs[:, 1] - uvs[:, 0]) + TEXELS.shares[:, 1:] * (uvs[:, 2] - uvs[:, 0])
    row, column = np.divmod(TEXELS.pixels, SIZE)
    assert_allclose(place * SIZE, np.stack([column + 0.5, SIZE - row - 0.5], axis=1), atol=1e-3)


def test_points_lie_on_the_mesh_or_in_the_plane_of_a_triangle_just_beyond_it():
    covered = np.isin(TEXELS.pixels, rasterized(LAYOUT.pixels(SIZE), SIZE, SIZE).pixels)
    radius = np.linalg.norm(TEXELS.points(MESH), axis=1)
    assert 0.9 < radius.min() and radius[covered].max() < 1.0 + 1e-6
    texel = np.linalg.norm(np.diff(MESH.vertices[MESH.triangles[:, :2]], axis=1)[:, 0], axis=1) / np.linalg.norm(
        np.diff(LAYOUT.pixels(SIZE)[:, :2], axis=1)[:, 0], axis=1
    )
    assert covered.sum() < len(covered) and radius[~covered].max() < 1.0 + 2.0 * texel.max()


def test_all_pixels_around_a_covered_one_are_texels():
    texel = np.zeros((SIZE + 2, SIZE + 2), bool)
    texel.ravel()[(TEXELS.pixels // SIZE + 1) * (SIZE + 2) + TEXELS.pixels % SIZE + 1] = True
    texel[[0, -1]] = texel[:, [0, -1]] = True  # beyond the picture
    row, column = np.divmod(rasterized(LAYOUT.pixels(SIZE), SIZE, SIZE).pixels, SIZE)
    assert all(texel[row + 1 + down, column + 1 + right].all() for down in (-1, 0, 1) for right in (-1, 0, 1))


def test_seeds_are_near_and_on_the_same_chart():
    seeds = TEXELS.seeds[TEXELS.seed_of]
    charts = LAYOUT.charts()
    assert np.array_equal(charts[TEXELS.triangles[seeds]], charts[TEXELS.triangles])
    apart = np.array(np.divmod(TEXELS.pixels[seeds], SIZE)) - np.array(np.divmod(TEXELS.pixels, SIZE))
    assert np.abs(apart).max() < STRIDE


def test_gutters_take_the_nearest_texel():
    image = TEXELS.image(np.arange(len(TEXELS.pixels)))
    row, column = np.divmod(TEXELS.pixels, SIZE)
    for pixel in TEXELS.gutter[:: len(TEXELS.gutter) // 50]:
        distance = (row - pixel // SIZE) ** 2 + (column - pixel % SIZE) ** 2
        assert distance[image.ravel()[pixel]] == distance.min()


def test_sharpened_texels_show_the_values_where_they_are_and_in_between():
    """Waves of eight texels along u, seen by linear interpolation between the middles of texels."""
    wave = lambda u: np.sin(2 * np.pi * u * SIZE / 8)
    row, column = np.divmod(TEXELS.pixels, SIZE)
    values = wave((column[:, None] + 0.5) / SIZE)
    deep = rasterized(LAYOUT.pixels(SIZE), SIZE, SIZE).pixels
    inside = np.isin(TEXELS.pixels, deep) & np.isin(TEXELS.pixels + 1, deep)
    right = np.array([0.0, 0.25, 0.5, 0.75])

    def error(shown: np.ndarray) -> float:
        image = TEXELS.image(shown)[..., 0]
        one, other = (image[row[inside], column[inside] + step][:, None] for step in (0, 1))
        return np.abs(one + right * (other - one) - wave((column[inside][:, None] + 0.5 + right) / SIZE)).mean()

    assert error(TEXELS.sharpened(values)) < 0.8 * error(values)
    assert_allclose(TEXELS.sharpened(np.full((len(TEXELS.pixels), 2), 7.0)), 7.0, atol=1e-5)
