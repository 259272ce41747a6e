"""Layouts: their charts, and stretch with known values."""

import numpy as np
import pytest

from refmesh_addon.core.color.layout import Layout, measured
from refmesh_addon.core.color.projected_layout import projected_layout
from refmesh_addon.core.color.raster import rasterized
from refmesh_addon.core.geometry.mesh import merged
from refmesh_addon.core.types import TriangleMesh

from .painted import cube_sphere

SQUARE = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])


def flat(scale) -> Layout:
    return Layout(SQUARE.vertices[:, :2] * scale, SQUARE.triangles)


@pytest.mark.parametrize("scale", [1.0, 0.1])
def test_equal_scale_is_no_stretch(scale):
    quality = measured(SQUARE, flat(scale))
    assert quality.stretch == pytest.approx(1.0)
    assert quality.area_used == pytest.approx(scale**2)
    assert (quality.charts, quality.lone_triangles, quality.mirrored) == (1, 0, 0.0)


def test_stretch_to_one_side_has_its_closed_form():
    """Singular values 1/2 and 1, brought to the best scale: (1/4 + 1) (4 + 1) under a root, halved."""
    assert measured(SQUARE, flat([0.5, 1.0])).stretch == pytest.approx(0.5 * np.sqrt(1.25 * 5.0))


def test_mirrored_triangles_are_counted():
    assert measured(SQUARE, flat([-1.0, 1.0])).mirrored == 1.0


def test_charts_are_connected_in_the_layout():
    mesh, layout = cube_sphere(4)
    quality = measured(mesh, layout)
    assert quality.charts == 6
    assert quality.area_used == pytest.approx(0.81)
    assert quality.stretch < 1.2


def test_pixels_count_from_the_top():
    assert flat(1.0).pixels(8)[0].tolist() == [[0, 8], [8, 8], [8, 0]]


@pytest.mark.parametrize("scale", [1.0, 1e-3, 1e4])
def test_projected_layout_is_valid_at_any_scale(scale):
    mesh = cube_sphere(12, turn=0.3)[0]
    mesh = merged(mesh.moved(mesh.vertices * scale))[0]
    layout = projected_layout(mesh)
    quality = measured(mesh, layout)
    assert quality.mirrored == 0.0
    assert quality.stretch < 1.1
    assert quality.area_used > 0.3
    pixels = rasterized(layout.pixels(512), 512, 512).pixels
    assert len(np.unique(pixels)) == len(pixels)
    assert 0.0 <= layout.uvs.min() and layout.uvs.max() <= 1.0
