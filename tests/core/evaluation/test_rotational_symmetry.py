"""Bodies whose spin the volume does not show."""

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from refmesh_addon.core.evaluation.rotational_symmetry import is_symmetric, symmetric_bodies
from refmesh_addon.core.types import TriangleMesh
from tests.core.shapes import ball, box, joined, of, torus


def turned(mesh, scale=1.0):
    return mesh.moved(scale * Rotation.from_rotvec([0.3, -0.8, 0.5]).apply(mesh.vertices) + [4.0, 2.0, 1.0])


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_balls_rings_and_capsules_are_symmetric_in_any_pose_and_scale(scale):
    capsule = of(trimesh.creation.capsule(height=2.0, radius=0.5))
    egg = TriangleMesh(ball(4).vertices * [1.0, 1.0, 1.6], ball(4).triangles)
    assert all(is_symmetric(turned(mesh, scale)) for mesh in (ball(4), torus(), capsule, egg))


def test_boxes_cubes_and_flattened_balls_are_not():
    flattened = TriangleMesh(ball(4).vertices * [1.0, 1.3, 1.6], ball(4).triangles)
    assert not any(is_symmetric(turned(mesh)) for mesh in (box((2.0, 1.2, 0.8), 4), box((1.0, 1.0, 1.0), 4), flattened))


def test_each_large_body_is_judged_by_itself():
    mesh = joined(box((2.0, 1.2, 0.8), 4), ball(3, 0.6, (3.0, 0, 0)), ball(2, 0.1, (-3.0, 0, 0)))
    assert_allclose(symmetric_bodies(mesh), [[3.0, 0.0, 0.0]], atol=1e-3)
    assert symmetric_bodies(box((2.0, 1.2, 0.8), 4)).shape == (0, 3)
    assert np.isfinite(symmetric_bodies(mesh)).all()
