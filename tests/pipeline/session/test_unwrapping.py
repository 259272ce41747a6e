"""Layouts from xatlas: valid, repeatable, not mirrored, and given up in time."""

import numpy as np
import pytest

from refmesh_addon.core.color.layout import measured
from refmesh_addon.core.color.raster import rasterized
from refmesh_addon.pipeline.session import unwrapping
from refmesh_addon.pipeline.session.unwrapping import unwrapped
from tests.core.shapes import ball, torus

pytest.importorskip("xatlas")


def test_layout_of_a_torus_is_valid_and_little_stretched():
    mesh = torus()
    layout = unwrapped(mesh)
    quality = measured(mesh, layout)
    assert 0.0 <= layout.uvs.min() and layout.uvs.max() <= 1.0
    assert quality.mirrored == 0.0
    assert quality.stretch < 1.1
    assert quality.area_used > 0.3


def test_charts_do_not_overlap():
    pixels = rasterized(unwrapped(torus()).pixels(256), 256, 256).pixels
    assert len(np.unique(pixels)) == len(pixels)


def test_same_mesh_in_another_unit_and_place_has_the_same_layout():
    mesh = ball()
    first, second = unwrapped(mesh), unwrapped(mesh.moved(mesh.vertices * 1024.0))
    assert np.array_equal(first.uvs, second.uvs) and np.array_equal(first.triangles, second.triangles)


def test_what_takes_too_long_is_given_up():
    assert unwrapped(ball(), time_limit=0.01) is None


def test_without_xatlas_there_is_no_layout(monkeypatch):
    monkeypatch.setattr(unwrapping, "layouts_available", lambda: False)
    assert unwrapped(ball()) is None
