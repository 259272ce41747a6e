"""Optical flow: known shifts come back where there is structure, and flat places are not trusted."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, map_coordinates

from refmesh_addon.core.color.optical_flow import flow_between

SIZE = 128
EVERYWHERE = np.ones((SIZE, SIZE), bool)
INNER = (slice(16, -16), slice(16, -16))


def picture() -> np.ndarray:
    noise = gaussian_filter(np.random.default_rng(0).normal(size=(SIZE, SIZE)), 2.0)
    return (128 + 60 * noise / noise.std()).astype(np.float32)


def shifted(image, right, down) -> np.ndarray:
    """What is at p in the image is at p + (right, down)."""
    y, x = np.indices(image.shape)
    return map_coordinates(image, [y - down, x - right], order=3, mode="nearest").astype(np.float32)


@pytest.mark.parametrize("right, down", [(0.0, 0.0), (0.3, -0.7), (2.5, 1.0), (-5.0, 6.0)])
def test_known_shift_comes_back(right, down):
    flow = flow_between(picture(), shifted(picture(), right, down), EVERYWHERE)
    error = np.linalg.norm(flow.offsets[INNER] - [right, down], axis=-1)
    assert flow.trusted[INNER].mean() > 0.8
    assert np.median(error[flow.trusted[INNER]]) < 0.1


def test_slow_turn_comes_back():
    image = picture()
    y, x = np.indices(image.shape) - SIZE / 2
    truth = 0.03 * np.stack([-y, x], axis=-1)
    turned = map_coordinates(image, [y - 0.03 * x + SIZE / 2, x + 0.03 * y + SIZE / 2], order=3).astype(np.float32)
    flow = flow_between(image, turned, EVERYWHERE)
    error = np.linalg.norm(flow.offsets - truth, axis=-1)[INNER]
    assert np.median(error[flow.trusted[INNER]]) < 0.15


def test_flat_picture_is_not_trusted():
    flat = np.full((SIZE, SIZE), 90.0, np.float32)
    flow = flow_between(flat, flat + np.random.default_rng(1).normal(0, 1, flat.shape).astype(np.float32), EVERYWHERE)
    assert not flow.trusted.any()


def test_what_is_outside_the_mask_does_not_count():
    image, mask = picture(), EVERYWHERE.copy()
    mask[:, 80:] = False
    second = shifted(image, 1.0, 0.0)
    second[:, 80:] = 255 - second[:, 80:]
    flow = flow_between(image, second, mask)
    assert not flow.trusted[:, 80:].any()
    inner = flow.trusted[16:-16, 16:72]
    assert np.median(np.abs(flow.offsets[16:-16, 16:72][inner] - [1.0, 0.0])) < 0.1


def test_noise_alone_is_no_motion():
    rng = np.random.default_rng(2)
    noisy = [picture() + rng.normal(0, 2, EVERYWHERE.shape).astype(np.float32) for _ in range(2)]
    flow = flow_between(*noisy, EVERYWHERE)
    assert np.abs(flow.offsets[INNER][flow.trusted[INNER]]).mean() < 0.1
