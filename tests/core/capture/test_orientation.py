"""Facing outward again: patches, whole bodies, hollows, and surfaces without sides."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.core.capture.orientation import flipped_patches, inside_out_bodies, reoriented
from refmesh_addon.core.types import TriangleMesh

from ..shapes import above, ball, box, flipped, inside_out, joined, torus, without


@pytest.mark.parametrize(
    "mesh",
    [ball(2), box(subdivisions=2), torus(), without(ball(2), above(ball(2), 0.5)), joined(ball(2), box(subdivisions=2, center=(4, 0, 0)))],
)
@pytest.mark.parametrize("share", [0.0, 0.1, 0.4])
def test_flipped_triangles_are_turned_back(mesh, share):
    chosen = np.random.default_rng(0).random(len(mesh.triangles)) < share
    result = reoriented(flipped(mesh, chosen), flipped_patches(flipped(mesh, chosen)))
    assert not flipped_patches(result).any(), "once is enough"
    assert_array_equal(result.triangles, mesh.triangles)


def test_an_inside_out_body_is_turned_and_a_hollow_is_not():
    apart = joined(ball(2), inside_out(box(center=(4, 0, 0))))
    assert_array_equal(inside_out_bodies(apart), np.arange(len(apart.triangles)) >= len(ball(2).triangles))
    assert not inside_out_bodies(joined(ball(2), inside_out(ball(1, 0.5)))).any()
    assert inside_out_bodies(inside_out(torus())).all()


def test_a_surface_with_one_side_is_left_alone():
    turns = np.linspace(0, np.pi, 21)[:-1]
    rim = np.stack([np.cos(2 * turns), np.sin(2 * turns), 0 * turns], axis=1)
    across = 0.3 * np.stack([np.cos(turns) * np.cos(2 * turns), np.cos(turns) * np.sin(2 * turns), np.sin(turns)], axis=1)
    vertices, k = np.vstack([rim + across, rim - across]), np.arange(20)
    after = np.where(k < 19, k + 1, 20)
    other = np.where(k < 19, k + 21, 0)
    moebius = TriangleMesh(vertices, np.vstack([np.stack([k, after, k + 20], axis=1), np.stack([after, other, k + 20], axis=1)]))
    assert not flipped_patches(moebius).any()
