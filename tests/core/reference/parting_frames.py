"""Centers that move a little, and two blocks of centers that part."""

import numpy as np


def random_points(count=40, seed=0):
    return np.random.default_rng(seed).random((count, 3)) * [2.0, 1.0, 0.7]


def random_frames(frames=4, count=40, noise=0.1):
    rng = np.random.default_rng(1)
    return random_points(count) + noise * rng.normal(size=(frames, count, 3))


def parting_frames():
    """Two blocks that touch in the first frame and slide off in the third."""
    lower, upper = random_points(30), random_points(30, seed=2) + [0, 0, 0.75]
    return np.stack([np.vstack([lower, upper + [slide, 0, 0]]) for slide in (0.0, 1.0, 2.5)])


def distances(points):
    return np.linalg.norm(points[:, None] - points[None], axis=2)
