import numpy as np
import pytest
import trimesh
from numpy.testing import assert_array_equal

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.geometry.mesh import is_watertight, mean_edge_length, signed_volume, vertex_components
from refmesh_addon.core.geometry.self_intersection import crossing_triangles
from refmesh_addon.core.surfacing.edge_collapse import collapsed
from refmesh_addon.core.surfacing.edge_flips import quality
from refmesh_addon.core.surfacing.reconstruction import screened_poisson
from refmesh_addon.core.surfacing.remeshing import remeshed
from refmesh_addon.core.types import TriangleMesh

from ..bodies import BODIES, distance, oriented_points
from ..shapes import inside_out, joined

bodies = pytest.mark.parametrize("body", BODIES.values(), ids=BODIES.keys())


@bodies
@pytest.mark.parametrize("triangles", [600, 3000])
def test_remeshing_keeps_the_surface_and_meets_the_budget(body, triangles):
    result = remeshed(body, triangles)
    assert triangles - 2 <= len(result.triangles) <= triangles
    assert is_watertight(result)
    assert vertex_components(result)[0] == vertex_components(body)[0]
    assert distance(result, body) < 0.1 * mean_edge_length(result)
    assert signed_volume(result) == pytest.approx(signed_volume(body), rel=0.07)
    assert not crossing_triangles(result).any()


def test_triangles_of_a_reconstruction_become_even_and_well_shaped():
    surface = screened_poisson(*oriented_points(BODIES["torus"], 20_000), 6)
    result = remeshed(surface, len(surface.triangles) // 3)
    shapes = quality(result.vertices, result.triangles)
    assert np.median(shapes) > 0.9
    assert np.percentile(shapes, 1) > 0.6


def test_creases_and_corners_stay_sharp():
    """A box of many triangles, reduced: the planes that meet at an edge hold it."""
    box = trimesh.creation.box(extents=[1.0, 2.0, 3.0]).subdivide().subdivide().subdivide().subdivide()
    body = TriangleMesh(np.asarray(box.vertices), np.asarray(box.faces))
    result, _ = collapsed(body, 300, np.zeros(len(body.vertices), bool))
    assert signed_volume(result) == pytest.approx(6.0, rel=2e-3)
    corners = np.array([[x, 2 * y, 3 * z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    assert max(np.linalg.norm(result.vertices - corner, axis=1).min() for corner in corners) < 0.01


def test_sheets_nearer_than_an_edge_do_not_come_to_cross():
    """Two shells with a gap of a fiftieth, reduced until edges are several gaps long."""
    shell = BODIES["ball"]
    inner = TriangleMesh(0.98 * shell.vertices, shell.triangles[:, ::-1])
    both = TriangleMesh(np.vstack([shell.vertices, inner.vertices]), np.vstack([shell.triangles, inner.triangles + len(shell.vertices)]))
    assert not crossing_triangles(both).any()
    assert not crossing_triangles(remeshed(both, 1200)).any()


@pytest.mark.parametrize("gap", [0.02, 0.004])
def test_sheets_far_closer_than_an_edge_do_not_come_to_cross_either(gap):
    shell = BODIES["ball"]
    both = joined(shell, inside_out(shell.moved((1 - gap) * shell.vertices)))
    assert not crossing_triangles(both).any()
    result = remeshed(both, 500)
    assert is_watertight(result) and not crossing_triangles(result).any()


def test_where_the_result_crosses_itself_the_mesh_does():
    """Two balls that overlap: no remeshing can keep them apart, and none is to add crossings."""
    ball = BODIES["ball"]
    both = joined(ball, ball.moved(ball.vertices + [1.1, 0.0, 0.0]))
    crossing = {tuple(map(tuple, both.vertices[triangle])) for triangle in both.triangles[crossing_triangles(both)]}
    result = remeshed(both, len(both.triangles) // 3)
    left = [tuple(map(tuple, result.vertices[triangle])) for triangle in result.triangles[crossing_triangles(result)]]
    assert len(left) and crossing >= set(left)
    assert len(result.triangles) < 0.7 * len(both.triangles), "what is far from the crossing is reduced all the same"


def test_frozen_vertices_stay():
    body = BODIES["ball"]
    frozen = body.vertices[:, 2] > 0.5
    result, left = collapsed(body, 700, frozen)
    assert set(np.flatnonzero(frozen)) <= set(left)
    assert_array_equal(result.vertices[frozen[left]], body.vertices[frozen])


def test_a_tetrahedron_is_not_collapsed():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    body = TriangleMesh(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    result, left = collapsed(body, 2, np.zeros(4, bool))
    assert len(result.triangles) == 4 and len(left) == 4


@pytest.mark.parametrize("scale", [1e-3, 10.0])
def test_remeshing_has_no_unit(scale):
    body = BODIES["two balls"]
    plain, result = remeshed(body, 600), remeshed(body.moved(scale * body.vertices), 600)
    assert len(result.triangles) == len(plain.triangles)
    assert distance(result.moved(result.vertices / scale), plain) < 0.1 * mean_edge_length(plain)


def test_the_same_mesh_gives_the_same_bytes():
    first, again = (remeshed(BODIES["torus"], 800) for _ in range(2))
    assert_array_equal(first.vertices, again.vertices)
    assert_array_equal(first.triangles, again.triangles)


def test_a_mesh_without_triangles_is_refused_rather_than_subdivided_forever():
    with pytest.raises(RefMeshError, match="no triangles"):
        remeshed(TriangleMesh(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32)), 100)
