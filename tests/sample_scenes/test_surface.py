"""Iso-surfaces of solids whose volume and surface are known."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sample_scenes.generators.shapes import ball, block, union
from sample_scenes.generators.surface import iso_surface


def mesh_of(solid, seed=0, cell=0.1):
    return iso_surface(solid, np.array([0.0, 0.0, 0.0]), 2.0, cell, np.random.default_rng(seed))


def volume(mesh) -> float:
    a, b, c = mesh.vertices[mesh.triangles].transpose(1, 0, 2)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def edges(mesh) -> np.ndarray:
    return np.concatenate([mesh.triangles[:, [0, 1]], mesh.triangles[:, [1, 2]], mesh.triangles[:, [2, 0]]])


@pytest.mark.parametrize("seed", range(6))
def test_surface_is_closed_and_each_edge_is_passed_once_each_way(seed):
    mesh = mesh_of(union(ball((0.3, 0, 0), 0.9), ball((-0.7, 0, 0), 0.5)), seed)
    directed = {tuple(edge) for edge in edges(mesh)}
    assert len(directed) == 3 * len(mesh.triangles)
    assert directed == {(b, a) for a, b in directed}


def test_vertices_lie_on_the_ball_and_triangles_face_outward():
    mesh = mesh_of(ball((0, 0, 0), 1.0))
    assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 1.0, atol=1e-12)
    assert_allclose(volume(mesh), 4 / 3 * np.pi, rtol=0.01)


def test_error_of_the_volume_falls_with_the_square_of_the_cell():
    errors = [4 / 3 * np.pi - volume(mesh_of(ball((0, 0, 0), 1.0), cell=cell)) for cell in (0.2, 0.1)]
    assert 3.5 < errors[0] / errors[1] < 4.5


def test_seed_decides_the_vertices():
    solid = block((0, 0, 0), (0.8, 0.6, 0.5), 0.2)
    assert np.array_equal(mesh_of(solid, 1).vertices, mesh_of(solid, 1).vertices)
    first, second = mesh_of(solid, 1), mesh_of(solid, 2)
    distances = np.linalg.norm(first.vertices[:, None] - second.vertices[None], axis=2).min(axis=1)
    assert np.median(distances) > 0.01


def test_solid_that_leaves_the_grid_is_refused():
    with pytest.raises(ValueError, match="reach"):
        mesh_of(ball((2.0, 0, 0), 1.5))
