"""Drift of a painted ball is removed, what misleads the flow is taken back, and blind vertices have no say."""

import numpy as np
import pytest

from refmesh_addon.core.color.drift_removal import AnchorPicture, Canvas, View
from refmesh_addon.core.types import TriangleMesh

from .painted import cube_sphere, painted

SIZE = 256
MESH, LAYOUT = cube_sphere(16)
SOURCE, SOURCE_LAYOUT = cube_sphere(24, turn=0.2)
ANGLE = 0.04  # of the slide, about z: over two texels
SIGHTED = np.zeros(len(MESH.vertices), bool)


def waves(points: np.ndarray) -> np.ndarray:
    gray = 128 + 35 * np.sin(points * [17.0, 19.0, 15.0] + [0.0, 1.0, 2.0]).sum(axis=1)
    return np.repeat(np.rint(gray)[:, None], 3, axis=1).astype(np.uint8)


def other(points: np.ndarray) -> np.ndarray:
    """A picture that has nothing to do with the waves."""
    gray = 128 + 35 * np.sin(points[:, [1, 2, 0]] * [23.0, 11.0, 29.0] + [2.0, 0.0, 1.0]).sum(axis=1)
    return np.repeat(np.rint(gray)[:, None], 3, axis=1).astype(np.uint8)


def view(mesh: TriangleMesh, color=waves, blind: np.ndarray = SIGHTED) -> View:
    return View(mesh, blind, SOURCE, painted(SOURCE, SOURCE_LAYOUT, 512, color))


def drifted(angle: float = ANGLE) -> TriangleMesh:
    cosine, sine = np.cos(angle), np.sin(angle)
    return MESH.moved(MESH.vertices @ np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]]))


@pytest.fixture(scope="module")
def anchor() -> AnchorPicture:
    return AnchorPicture(Canvas(MESH, LAYOUT, SIZE), view(MESH))


def test_drift_is_removed_where_the_pictures_agree_afterward(anchor):
    slide = anchor.without_drift(view(drifted()))
    before, after = (np.linalg.norm(vertices - MESH.vertices, axis=1) for vertices in (drifted().vertices, slide.vertices))
    assert slide.agreeing.mean() > 0.6
    assert np.median(after) < 0.25 * np.median(before)
    assert np.percentile(after, 95) < 0.6 * np.percentile(before, 95)


def test_a_slide_beyond_the_reach_of_flow_needs_a_guess(anchor):
    """By half a radian, several waves of the picture; the guess is wrong by two texels."""
    far, guess = drifted(0.5), drifted(ANGLE).vertices
    slides = [anchor.without_drift(view(far), start) for start in (None, guess)]
    alone, guided = (np.median(np.linalg.norm(slide.vertices - MESH.vertices, axis=1)) for slide in slides)
    assert guided < 0.01 < 0.2 < alone


def test_another_picture_moves_nothing(anchor):
    slide = anchor.without_drift(view(drifted(), other))
    assert not slide.agreeing.any()
    np.testing.assert_array_equal(slide.vertices, drifted().vertices)


def test_a_mesh_without_drift_stays(anchor):
    slide = anchor.without_drift(view(MESH))
    assert np.abs(slide.vertices - MESH.vertices).max() < 1e-6


def test_what_no_camera_saw_moves_nothing(anchor):
    slide = anchor.without_drift(view(drifted(), blind=~SIGHTED))
    assert not slide.agreeing.any()
