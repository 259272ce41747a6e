"""The surface fit: what it must not change, known motion, hidden areas, holes and parts that were missed."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from refmesh_addon.core.deformation import surface_fit
from refmesh_addon.core.deformation.arap import ArapSolver
from refmesh_addon.core.deformation.correspondence import Correspondence
from refmesh_addon.core.deformation.surface_fit import fit_surface
from refmesh_addon.core.deformation.surface_samples import SurfaceSampler
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.geometry.mesh import mean_edge_length, triangle_areas, triangle_normals, vertex_normals
from refmesh_addon.core.geometry.rotations import closest_rotations
from refmesh_addon.core.types import TriangleMesh
from tests.core.bending_bar import bar, bent
from tests.core.shapes import ball, joined

REFERENCE = bar(60, 24, uneven=0.15, seed=1)
BENT = bent(REFERENCE.vertices)
MEAN_EDGE = mean_edge_length(REFERENCE)


def bent_source():
    """The same body in another pose and other triangles."""
    mesh = bar(67, 27, uneven=0.15, seed=2)
    return mesh.moved(bent(mesh.vertices))


def smooth_error(points, size):
    """A smooth field of displacements, `size` long in the mean: what the tracked centers leave."""
    rng = np.random.default_rng(3)
    field = sum(np.sin(points @ rng.normal(size=3) * 2 + rng.uniform(0, 6))[:, None] * rng.normal(size=3) for _ in range(10))
    return field * size / np.linalg.norm(field, axis=1).mean()


def between(source, reference=REFERENCE, compatible=None):
    return Correspondence(SurfaceIndex(source), SurfaceSampler(reference), compatible)


def fit(start, source, compatible=None, rounds=6):
    return fit_surface(ArapSolver(REFERENCE), start, between(source, compatible=compatible), rounds)


def along_surface(offsets, mesh):
    normals = vertex_normals(mesh)
    return np.linalg.norm(offsets - normals * np.einsum("ij,ij->i", offsets, normals)[:, None], axis=1)


def test_a_surface_fitted_to_itself_does_not_move():
    result = fit(BENT, REFERENCE.moved(BENT))
    assert_allclose(result.vertices, BENT, atol=1e-9)
    assert not result.held.any()
    assert_allclose(result.residuals, 0.0, atol=1e-9)


def test_known_motion_lies_on_the_source_without_sliding_or_folding():
    source, diagonal = bent_source(), REFERENCE.diagonal
    noise = 0.0005 * diagonal * np.random.default_rng(4).normal(size=BENT.shape)
    result = fit(BENT + smooth_error(BENT, 0.003 * diagonal) + noise, source)
    fitted = REFERENCE.moved(result.vertices)
    # A vertex on the true body lies off the source's flat triangles by at most their sagitta.
    sagitta = SurfaceIndex(source).query(BENT).distances
    missed = SurfaceIndex(source).query(fitted.vertices).distances
    assert missed.mean() < 1.2 * sagitta.mean()
    assert missed.max() < 1.5 * sagitta.max()
    assert SurfaceIndex(fitted).query(source.vertices).distances.max() < 1.5 * sagitta.max()
    assert np.median(along_surface(fitted.vertices - BENT, fitted)) < 0.3 * MEAN_EDGE
    true_normals = triangle_normals(REFERENCE.moved(BENT))
    assert np.mean(np.einsum("ij,ij->i", true_normals, triangle_normals(fitted)) < 0) < 0.001
    assert result.residuals[-1] < 0.4 * result.residuals[0]  # what is left is the sagitta of flat triangles


def test_the_truth_stays_in_place():
    result = fit(BENT, bent_source())
    assert np.median(along_surface(result.vertices - BENT, REFERENCE.moved(BENT))) < 0.05 * MEAN_EDGE


def test_turning_shifting_and_scaling_the_problem_does_so_to_the_answer():
    source, start = bent_source(), BENT + smooth_error(BENT, 0.003 * REFERENCE.diagonal)
    turn = closest_rotations(np.random.default_rng(5).normal(size=(1, 3, 3)))[0]

    def carry(points):
        return 100.0 * points @ turn.T + [2e3, -3e3, 1e3]

    expected = carry(fit(start, source).vertices)
    carried = ArapSolver(REFERENCE.moved(carry(REFERENCE.vertices)))
    result = fit_surface(carried, carry(start), between(source.moved(carry(source.vertices)), carried.mesh))
    assert_allclose(result.vertices, expected, atol=1e-3 * 100 * MEAN_EDGE)


def test_what_the_source_does_where_pairs_are_refused_changes_nothing():
    source = bent_source()
    beyond = source.vertices[:, 0] > 0.8
    swollen = source.vertices + beyond[:, None] * 0.05 * vertex_normals(source)
    triangle_beyond = beyond[source.triangles].any(axis=1)

    def compatible(vertices, triangles):
        return ~triangle_beyond[triangles]

    start = BENT + smooth_error(BENT, 0.003 * REFERENCE.diagonal)
    one, other = fit(start, source, compatible), fit(start, source.moved(swollen), compatible)
    hidden = start[:, 0] > 1.0
    assert one.held[hidden].all()
    assert not one.held[start[:, 0] < 0.5].any()
    assert_allclose(one.vertices, other.vertices, atol=0.02 * MEAN_EDGE)
    # ARAP alone carries the hidden end along without tearing or stretching it.
    edges = REFERENCE.triangles[np.all(hidden[REFERENCE.triangles], axis=1)][:, :2]
    lengths = [np.linalg.norm(p[edges[:, 0]] - p[edges[:, 1]], axis=1) for p in (start, one.vertices)]
    assert_allclose(lengths[1], lengths[0], rtol=0.1)


def test_a_hole_of_the_source_is_bridged():
    source = bent_source()
    outside_of_the_bend = bent(np.array([[0.0, -0.6, 0.0]]))
    hole = np.linalg.norm(source.vertices[source.triangles].mean(axis=1) - outside_of_the_bend, axis=1) < 0.4
    result = fit(BENT + smooth_error(BENT, 0.002 * REFERENCE.diagonal), TriangleMesh(source.vertices, source.triangles[~hole]))
    missed = SurfaceIndex(source).query(result.vertices).distances
    assert result.held.sum() > 10
    assert missed[result.held].max() < 0.3 * MEAN_EDGE


def test_a_tip_that_was_missed_is_reached():
    source = bar(67, 27, uneven=0.15, seed=2)
    short = REFERENCE.vertices * [0.97, 1.0, 1.0]
    result = fit(short, source)
    tip = source.vertices[:, 0] > 1.9
    before = SurfaceIndex(REFERENCE.moved(short)).query(source.vertices[tip]).distances
    after = SurfaceIndex(REFERENCE.moved(result.vertices)).query(source.vertices[tip]).distances
    assert after.max() < 0.15 * before.max()


def test_a_hidden_layer_that_pokes_through_is_pushed_below():
    """A ball within a ball, of one body: the source shows the outer one, and the inner one may not be seen through it."""
    outer, source = ball(4), ball(4)
    inner_side = TriangleMesh(outer.vertices, outer.triangles[:, ::-1])
    both = joined(outer, inner_side.moved(0.9 * outer.vertices))
    count, bump = len(outer.vertices), outer.vertices[:, 2] > 0.9
    start = both.vertices.copy()
    start[count:][bump] *= 1.04 / 0.9
    outside = lambda positions: np.linalg.norm(positions[count:], axis=1) - 1.0
    assert outside(start)[bump].min() > 0.03
    fitted = fit_surface(ArapSolver(both), start, between(source, both))
    assert outside(fitted.vertices).max() < 0
    assert_allclose(fitted.vertices[:count], start[:count], atol=0.05 * mean_edge_length(outer))


def test_a_finer_mesh_reaches_no_more_edges_in_the_last_round(monkeypatch):
    size = np.sqrt(triangle_areas(REFERENCE).sum())
    source = REFERENCE.moved(BENT + 0.8 * surface_fit.REACH[1] * size * vertex_normals(REFERENCE.moved(BENT)))
    held = []
    for edges in (surface_fit.LAST_EDGES, 0.5 * surface_fit.REACH[1] * size / MEAN_EDGE):
        monkeypatch.setattr(surface_fit, "LAST_EDGES", edges)
        held.append(fit(BENT, source, rounds=1).held.mean())
    assert held[0] < 0.05 and held[1] > 0.95


def test_of_a_dense_source_only_the_last_round_takes_all_samples(monkeypatch):
    dense = bar(134, 54, uneven=0.15, seed=2)
    source, start = dense.moved(bent(dense.vertices)), BENT + smooth_error(BENT, 0.003 * REFERENCE.diagonal)
    strides, missed = [], []
    real = Correspondence.from_source
    counted = lambda self, mesh, limits, *rest: strides.append(limits.stride) or real(self, mesh, limits, *rest)
    monkeypatch.setattr(Correspondence, "from_source", counted)
    for triangles in (surface_fit.DENSE_TRIANGLES, len(source.triangles) // 2):
        monkeypatch.setattr(surface_fit, "DENSE_TRIANGLES", triangles)
        missed.append(SurfaceIndex(source).query(fit(start, source).vertices).distances.mean())
    usual, thinned = np.array(strides).reshape(2, -1)
    assert usual[-1] == thinned[-1] == 1 and (thinned[:-1] == 4 * usual[:-1]).all()
    assert missed[1] == pytest.approx(missed[0], rel=0.1)


def test_a_source_out_of_reach_leaves_everything_in_place():
    result = fit(BENT, REFERENCE.moved(BENT + [0.0, 0.0, 50.0]))
    assert_allclose(result.vertices, BENT, atol=1e-9)
    assert result.held.all()
    assert not result.residuals.any()


def test_progress_ends_at_one_and_no_round_gives_the_start():
    shares = []
    fit_surface(ArapSolver(REFERENCE), BENT, between(bent_source()), 2, progress=shares.append)
    assert shares == [0.5, 1.0]
    result = fit(BENT, bent_source(), rounds=0)
    assert np.array_equal(result.vertices, BENT)
    assert result.held.all()


def test_refuses_a_start_of_another_mesh():
    with pytest.raises(ValueError, match="to keep the topology"):
        fit(BENT[:-1], bent_source())
