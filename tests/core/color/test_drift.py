"""Drift: vertices that slid on a painted ball come back to their spot, and a plain ball moves nothing."""

import numpy as np

from refmesh_addon.core.color.drift import slid
from refmesh_addon.core.color.optical_flow import Flow, flow_between
from refmesh_addon.core.color.texels import Texels
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.types import TriangleMesh

from .painted import cube_sphere

SIZE = 256
MESH, LAYOUT = cube_sphere(16)
TEXELS = Texels.of(LAYOUT, SIZE)
SOURCE = SurfaceIndex(cube_sphere(40, turn=0.2)[0])
ANGLE = 0.04  # of the slide, about z: over two texels


def turned(mesh: TriangleMesh, angle: float) -> TriangleMesh:
    cosine, sine = np.cos(angle), np.sin(angle)
    return mesh.moved(mesh.vertices @ np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]]))


def luma(mesh: TriangleMesh) -> np.ndarray:
    """What the layout shows of a pattern that is fixed in space."""
    points = TEXELS.points(mesh)
    waves = np.sin(points * [17.0, 19.0, 15.0] + [0.0, 1.0, 2.0]).sum(axis=1)
    return TEXELS.image((128 + 35 * waves).astype(np.float32))


def mask() -> np.ndarray:
    covered = np.zeros(SIZE * SIZE, bool)
    covered[TEXELS.pixels] = True
    return covered.reshape(SIZE, SIZE)


def test_slide_is_undone():
    drifted = turned(MESH, ANGLE)
    result = slid(drifted, LAYOUT, TEXELS, flow_between(luma(MESH), luma(drifted), mask()), SOURCE)
    before, after = (np.linalg.norm(mesh.vertices - MESH.vertices, axis=1) for mesh in (drifted, result))
    assert np.median(after) < 0.3 * np.median(before)
    assert np.percentile(after, 95) < 0.7 * np.percentile(before, 95)


def test_vertices_keep_their_height_above_the_source():
    drifted = turned(MESH, ANGLE)
    result = slid(drifted, LAYOUT, TEXELS, flow_between(luma(MESH), luma(drifted), mask()), SOURCE)
    heights = [SOURCE.query(mesh.vertices).distances for mesh in (drifted, result)]
    assert np.percentile(heights[1], 99) < np.percentile(heights[0], 99) + 2e-3


def test_no_trust_is_no_motion():
    nothing = Flow(np.full((SIZE, SIZE, 2), 3.0, np.float32), np.zeros((SIZE, SIZE), bool))
    np.testing.assert_allclose(slid(MESH, LAYOUT, TEXELS, nothing, SOURCE).vertices, MESH.vertices, atol=1e-9)
