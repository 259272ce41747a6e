"""Drift that grows from frame to frame is followed by the slides between neighbors."""

import numpy as np
from scipy.spatial.transform import Rotation

from refmesh_addon.core.color.drift_chain import carried

from .painted import cube_sphere

MESH = cube_sphere(16)[0]
FRAMES = 5
SLIDE = Rotation.from_rotvec([0, 0, 0.11])  # of the mesh along the ball from frame to frame: more than an edge
TURN = Rotation.from_rotvec([0.2, 0.1, 0])  # of the ball


def skin(points: np.ndarray, frame: int) -> np.ndarray:
    """Where spots of the ball that are at `points` in frame 0 are."""
    return (TURN**frame).apply(points)


def test_slides_add_up():
    slides = [(SLIDE**frame).apply(MESH.vertices) for frame in range(FRAMES)]
    places = MESH.vertices
    for frame, slide in enumerate(slides):
        places = carried(places, MESH.moved(skin(slide, frame)), skin(slide, frame + 1))
    last = skin((SLIDE**FRAMES).apply(MESH.vertices), FRAMES)
    assert np.abs(places - skin(MESH.vertices, FRAMES)).max() < 0.01
    assert np.abs(last - skin(MESH.vertices, FRAMES)).max() > 0.4


def test_no_slide_is_no_change():
    np.testing.assert_allclose(carried(MESH.vertices, MESH, MESH.vertices), MESH.vertices, atol=1e-6)
