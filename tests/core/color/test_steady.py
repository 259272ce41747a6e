"""One steady texture: outliers go, unseen texels are filled, and blur gives way to a sharp frame."""

import numpy as np

from refmesh_addon.core.color.steady import filled, median_seen, steady_texture
from refmesh_addon.core.color.texels import Texels

from .painted import cube_sphere

MESH, LAYOUT = cube_sphere(6)
TEXELS = Texels.of(LAYOUT, 128)
COUNT = len(TEXELS.pixels)
RNG = np.random.default_rng(0)


def stripes(shift: float) -> np.ndarray:
    row, column = np.divmod(TEXELS.pixels, TEXELS.size)
    return np.where(((column + shift) % 8 < 4)[:, None], 200, 60).astype(np.uint8).repeat(3, axis=1)


def test_median_is_that_of_the_frames_that_see_a_texel():
    colors = RNG.integers(0, 256, (5, COUNT, 3), dtype=np.uint8)
    seen = RNG.random((5, COUNT)) < 0.6
    result = median_seen(colors, seen)
    for texel in range(0, COUNT, COUNT // 40):
        used = seen[:, texel] if seen[:, texel].any() else np.ones(5, bool)
        values = np.sort(colors[used, texel], axis=0)
        assert np.array_equal(result[texel], values[(len(values) - 1) // 2])


def test_one_bad_frame_leaves_no_trace():
    colors = np.stack([stripes(0)] * 4 + [255 - stripes(0)])
    steady, seen = steady_texture(TEXELS, colors, np.ones(colors.shape[:2], bool))
    assert np.array_equal(steady, stripes(0))
    assert seen.all()


def test_sharp_frame_shows_where_the_median_blurs():
    colors = np.stack([stripes(shift) for shift in range(8)])
    steady, _ = steady_texture(TEXELS, colors, np.ones(colors.shape[:2], bool))
    values = np.unique(steady)
    assert set(values.tolist()) == {60, 200}
    agreeing = [(steady == frame).all(axis=1).mean() for frame in colors]
    assert max(agreeing) > 0.9  # one frame, not a mixture


def test_what_a_frame_does_not_see_comes_from_those_that_do():
    colors = np.stack([np.full((COUNT, 3), 10, np.uint8), np.full((COUNT, 3), 90, np.uint8)])
    seen = np.stack([np.arange(COUNT) % 2 == 0, np.ones(COUNT, bool)])
    steady, steady_seen = steady_texture(TEXELS, colors, seen)
    result = filled(colors[0], seen[0], steady, steady_seen)
    assert (result[seen[0]] == 10).all() and (result[~seen[0]] == 90).all()
