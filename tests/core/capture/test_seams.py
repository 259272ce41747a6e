"""Seams that do not quite close are closed; holes, wide gaps and fine rims stay."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from refmesh_addon.core.capture.seams import stitched
from refmesh_addon.core.geometry.mesh import is_watertight, signed_volume
from refmesh_addon.core.types import TriangleMesh

from ..shapes import above, ball, moved, without


def cut_up(mesh, gap):
    """Every triangle with corners of its own, no two of which are moved further apart than `gap`."""
    corners = mesh.vertices[mesh.triangles].reshape(-1, 3)
    away = np.random.default_rng(0).uniform(-0.5, 0.5, corners.shape) * gap / np.sqrt(3)
    return TriangleMesh(corners + away, np.arange(len(corners)).reshape(-1, 3))


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_seam_open_by_a_hair_is_closed(scale):
    body = moved(ball(), scale=scale)
    closed = stitched(cut_up(body, 5e-5 * body.diagonal))
    assert is_watertight(closed)
    assert len(closed.vertices) == len(body.vertices)
    assert_allclose(signed_volume(closed), signed_volume(body), rtol=1e-3)


def test_what_needs_no_sewing_comes_back_as_it_is():
    body = ball()
    for mesh in (body, without(body, above(body, 0.7))):
        assert stitched(mesh) is mesh


def test_a_wide_gap_stays_open():
    body = ball()
    assert len(stitched(cut_up(body, 5e-3 * body.diagonal)).vertices) > 2 * len(body.vertices)


def test_a_fine_rim_is_not_gathered():
    """Edges shorter than a hair: their ends are neighbors along the rim, not two sides of a seam."""
    turns = np.linspace(0.0, 2 * np.pi, 50_000, endpoint=False)
    rim, around = np.column_stack([np.cos(turns), np.sin(turns), np.zeros_like(turns)]), np.arange(len(turns))
    disc = TriangleMesh(np.vstack([rim, np.zeros((1, 3))]), np.column_stack([around, np.roll(around, -1), np.full(len(rim), len(rim))]))
    assert stitched(disc) is disc
