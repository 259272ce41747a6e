"""Edges split in the middle: the same surface, closed as before, and no edge longer than allowed."""

import numpy as np
import pytest

from refmesh_addon.core.geometry.half_edges import HalfEdges
from refmesh_addon.core.geometry.mesh import is_watertight, signed_volume, triangle_areas
from refmesh_addon.core.geometry.subdivision import with_short_edges

from ..shapes import TILT, ball, box, moved


def longest_edge(mesh):
    start, end = mesh.vertices[HalfEdges.of(mesh).edges].transpose(1, 0, 2)
    return np.linalg.norm(end - start, axis=1).max()


@pytest.mark.parametrize("longest", [1.3, 0.7, 0.2])
def test_the_surface_stays_and_edges_are_short(longest):
    mesh = moved(box((2, 1.2, 0.8)), TILT)
    result = with_short_edges(mesh, longest)
    assert longest_edge(result) <= longest
    assert is_watertight(result)
    assert signed_volume(result) == pytest.approx(signed_volume(mesh))
    assert triangle_areas(result).sum() == pytest.approx(triangle_areas(mesh).sum())
    assert triangle_areas(result).min() > 0


def test_a_mesh_without_long_edges_stays_as_it_is():
    assert with_short_edges(ball(2), 1.0) is not None
    mesh = ball(2)
    assert with_short_edges(mesh, longest_edge(mesh)) is mesh
