"""What lays a mesh out where xatlas, Blender or both are missing or take too long."""

from importlib.util import find_spec

import numpy as np
import pytest

from refmesh_addon.core.color.layout import measured
from refmesh_addon.core.color.raster import rasterized
from refmesh_addon.pipeline.session import unwrapping
from refmesh_addon.pipeline.session.blender_program import BLENDER, blender_command
from refmesh_addon.pipeline.session.flattening import flattened
from refmesh_addon.pipeline.session.layouts import best_layout
from refmesh_addon.pipeline.session.unwrapping import layouts_available
from tests.core.shapes import ball, torus

needs_blender = pytest.mark.skipif(find_spec("bpy") is None, reason="bpy is not installed")


@pytest.fixture
def without_xatlas(monkeypatch):
    monkeypatch.setattr(unwrapping, "layouts_available", lambda: False)


@pytest.fixture
def with_blender(monkeypatch):
    monkeypatch.delenv(BLENDER)


def check(mesh, layout):
    """Little stretched, none mirrored, hardly an overlap, and much of the texture used."""
    quality, pixels = measured(mesh, layout), rasterized(layout.pixels(512), 512, 512).pixels
    assert quality.mirrored == 0.0 and quality.stretch < 1.1 and quality.area_used > 0.4
    assert len(pixels) - len(np.unique(pixels)) < 0.005 * len(pixels)


@needs_blender
def test_smart_uv_and_angle_based_unwrap_where_xatlas_is_missing(without_xatlas, with_blender):
    mesh = torus()
    layout, source = best_layout(mesh)
    assert source == "smart_uv_abf"
    check(mesh, layout)
    assert measured(mesh, layout).charts < 20


@needs_blender
@pytest.mark.skipif(not layouts_available(), reason="xatlas is not installed")
def test_charts_of_xatlas_are_laid_out_by_blender_where_that_uses_more_of_the_texture(with_blender):
    mesh = torus()
    layout, source = best_layout(mesh)
    plain = measured(mesh, unwrapping.unwrapped(mesh))
    assert source in ("xatlas_abf", "xatlas")
    check(mesh, layout)
    assert measured(mesh, layout).area_used / measured(mesh, layout).stretch >= plain.area_used / plain.stretch


@needs_blender
def test_blender_is_given_up_after_the_time_limit(with_blender):
    assert flattened(ball(), None, time_limit=0.01) is None


@pytest.mark.parametrize("program", ["", "/nowhere/blender"])
def test_projection_where_there_is_neither(program, without_xatlas, monkeypatch):
    monkeypatch.setenv(BLENDER, program)
    assert (blender_command() is None) == (program == "")
    layout, source = best_layout(ball())
    assert source == "projected" and measured(ball(), layout).mirrored == 0.0
