"""Charts: told from their places, small ones joined to a neighbor, bad ones named."""

import numpy as np

from refmesh_addon.core.color.charts import charts_of, flawed_charts, joined_charts, seams
from refmesh_addon.core.color.layout import stretches
from refmesh_addon.core.geometry.half_edges import HalfEdges
from refmesh_addon.core.geometry.mesh import merged, triangle_areas
from refmesh_addon.core.types import TriangleMesh

from .painted import cube_sphere


def ball():
    """A closed ball whose layout is six squares, and the corners of that."""
    mesh, layout = cube_sphere(7)
    return merged(mesh)[0], layout.corners


def grid(count: int) -> TriangleMesh:
    """A flat square of 2 count^2 triangles."""
    x, y = np.meshgrid(np.linspace(0, 1, count + 1), np.linspace(0, 1, count + 1))
    corner = np.arange(count * (count + 1)).reshape(count, count + 1)[:, :-1].ravel()
    quads = np.column_stack([corner, corner + 1, corner + count + 2, corner + count + 1])
    return TriangleMesh(np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()]), np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]]))


def test_charts_are_what_the_layout_connects():
    mesh, corners = ball()
    charts = charts_of(mesh, corners)
    assert np.array_equal(np.unique(charts), np.arange(6))
    assert len(set(np.bincount(charts))) == 1


def test_seams_are_the_borders_of_charts():
    mesh, corners = ball()
    charts, table = charts_of(mesh, corners), HalfEdges.of(mesh)
    cut, (one, other) = seams(mesh, charts), table.pairs.T
    assert np.array_equal(cut[one], charts[one // 3] != charts[other // 3])
    assert np.array_equal(cut[one], cut[other])


def test_small_charts_join_the_neighbor_with_the_longest_common_border():
    mesh = grid(10)
    middles = mesh.vertices[mesh.triangles].mean(axis=1)
    charts = (middles[:, 0] > 0.5).astype(int)
    small = (np.abs(middles[:, 0] - 0.45) < 0.049) & (np.abs(middles[:, 1] - 0.35) < 0.049)  # a square of the left half, at the right one
    charts[small] = 2
    assert np.array_equal(joined_charts(mesh, charts, least=0.005), charts)
    joined = joined_charts(mesh, charts, least=0.02)
    assert set(joined[small]) == set(joined[(charts == 0)]) and len(np.unique(joined)) == 2


def test_joining_leaves_only_charts_that_are_large_or_alone():
    mesh = grid(12)
    charts = np.random.default_rng(0).integers(0, 40, len(mesh.triangles))
    sizes = np.bincount(joined_charts(mesh, charts, least=0.1), triangle_areas(mesh))
    assert sizes.min() >= 0.1 and np.isclose(sizes.sum(), 1.0)
    assert np.array_equal(joined_charts(mesh, np.zeros(len(charts), int), least=0.5), np.zeros(len(charts), int))


def test_stretched_folded_and_overlapping_charts_are_named():
    mesh, corners = ball()
    charts = charts_of(mesh, corners)
    assert not flawed_charts(mesh, corners, charts).any() or stretches(mesh, corners, charts).max() > 1.1
    flat = grid(8)
    places, one = 0.9 * flat.vertices[flat.triangles][:, :, :2], np.zeros(len(flat.triangles), int)
    assert not flawed_charts(flat, places, one).any()
    assert flawed_charts(flat, places * [1.0, 0.3], one).all()  # stretched
    assert flawed_charts(flat, 0.9 - places[:, ::-1] * [1.0, 1.0], one).all()  # mirrored
    moved = places.copy()
    moved[:8] = places[40:48]  # one row over another
    assert flawed_charts(flat, moved, one).all()


def test_stretch_is_that_of_each_chart_alone():
    flat = grid(6)
    places = flat.vertices[flat.triangles][:, :, :2].copy()
    charts = (flat.vertices[flat.triangles].mean(axis=1)[:, 0] > 0.5).astype(int)
    places[charts == 1] *= [0.25, 0.5]  # singular values 1/4 and 1/2 are 1/sqrt(2) and sqrt(2) at their best scale
    assert np.allclose(stretches(flat, places, charts), [1.0, (0.5 + 2.0 + 2.0 + 0.5) / 4])
