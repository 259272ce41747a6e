"""The shell behind an open surface: closed, of one thickness, and thinner only where the surface is curved more tightly."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.capture.shell import shell_behind
from refmesh_addon.core.geometry.mesh import is_watertight, signed_volume, triangle_areas

from ..shapes import TILT, above, ball, inside_out, moved, without
from .test_depth_artifacts import sheet


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_flat_sheet_becomes_a_plate_behind_it(scale):
    mesh = moved(sheet(8), TILT, scale=scale)
    shell = shell_behind(mesh, 0.1 * scale)
    assert is_watertight(shell)
    assert_allclose(signed_volume(shell), 0.1 * scale**3)
    assert_array_equal(shell.triangles[: len(mesh.triangles)], mesh.triangles)
    assert_array_equal(shell.vertices[: len(mesh.vertices)], mesh.vertices)


def test_half_a_ball_gets_the_volume_between_two_halves():
    half = without(ball(4), ~above(ball(4), 0.0))
    shell = shell_behind(half, 0.1)
    assert is_watertight(shell)
    assert signed_volume(shell) == pytest.approx(triangle_areas(half).sum() * (1 - 0.9**3) / 3, rel=0.05)


def test_a_shell_faces_as_its_surface_does():
    mesh = sheet(8)
    assert_allclose(shell_behind(inside_out(mesh), 0.1).vertices[-1] - mesh.vertices[-1], [0, 0, 0.1])


def test_where_the_border_is_changes_nothing_of_the_shell_elsewhere():
    whole, cut = sheet(12), sheet(12, cut=[(11, column) for column in range(12)])
    inner = whole.vertices[:, 0] < 0.8
    backs = [shell_behind(mesh, 0.1).vertices[len(mesh.vertices) :] for mesh in (whole, cut)]
    assert_array_equal(backs[0][inner], backs[1][inner])


def test_a_surface_that_is_curved_more_tightly_than_the_shell_is_thick_gets_a_thinner_one():
    half = without(ball(3, radius=0.05), ~above(ball(3, radius=0.05), 0.0))
    shell = shell_behind(half, 0.1)
    back = shell.vertices[len(half.vertices) :]
    assert np.linalg.norm(back - half.vertices, axis=1).max() < 0.05
    assert triangle_areas(shell).min() > 0 and signed_volume(shell) > 0
