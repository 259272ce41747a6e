"""The partner of a sample: the closest point where it fits, what lies straight above or below where it does not, nothing beside."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.deformation.partners import Limits, closest_partners
from refmesh_addon.core.deformation.surface_samples import SurfaceSamples
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.geometry.mesh import triangle_normals
from refmesh_addon.core.types import TriangleMesh
from tests.core.shapes import joined

LIMITS = Limits(distance=1.0, cosine=0.5)
ANY = lambda samples, triangles: np.ones(len(samples), dtype=bool)


def square(height, left, facing_up=True):
    """A square of side 1 at z = height, from x = left on."""
    corners = np.array([[left, 0, height], [left + 1, 0, height], [left + 1, 1, height], [left, 1, height]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    return TriangleMesh(corners, triangles if facing_up else triangles[:, ::-1])


def partners(surface, height=0.3, allowed=ANY):
    """Those of one sample that faces up, over the middle of the square that begins at 0."""
    point, up = np.array([[0.4, 0.5, height]]), np.array([[0.0, 0.0, 1.0]])
    zero = np.zeros(1, dtype=int)
    sample = SurfaceSamples(point, up, zero, np.zeros((1, 3), dtype=int), np.full((1, 3), 1 / 3), np.ones(1))
    return closest_partners(sample, SurfaceIndex(surface), triangle_normals(surface), LIMITS, allowed)


def test_the_closest_point_that_fits_is_the_partner():
    paired, unpaired = partners(square(0.0, 0.0))
    assert_allclose(paired.points, [[0.4, 0.5, 0.0]], atol=1e-12)
    assert_allclose(paired.distances, 0.3)
    assert not len(unpaired.samples)


def test_past_what_does_not_fit_the_partner_is_straight_below():
    layers = joined(square(0.2, 0.0, facing_up=False), square(0.0, 0.0))
    paired, _ = partners(layers)
    assert_allclose(paired.points, [[0.4, 0.5, 0.0]], atol=1e-12)
    refused = lambda samples, triangles: triangles >= 2
    paired, _ = partners(joined(square(0.2, 0.0), square(0.0, 0.0)), allowed=refused)
    assert_allclose(paired.points, [[0.4, 0.5, 0.0]], atol=1e-12)


def test_what_lies_beside_is_no_partner():
    paired, unpaired = partners(joined(square(0.2, 0.0, facing_up=False), square(0.2, 0.8)))
    assert not len(paired.samples)
    assert_array_equal(unpaired.samples, [0])
    assert_allclose(unpaired.points, [[0.4, 0.5, 0.2]], atol=1e-12)  # the closest of all, whether or not it fits


def test_what_has_nothing_within_the_distance_is_in_neither():
    paired, unpaired = partners(square(0.0, 0.0), height=1.5)
    assert not len(paired.samples) and not len(unpaired.samples)
