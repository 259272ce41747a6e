"""A surface that crosses itself is smoothed where it does, and nowhere else."""

import numpy as np
from numpy.testing import assert_array_equal

from refmesh_addon.core.geometry.self_intersection import crossing_triangles
from refmesh_addon.core.surfacing.untangling import untangled

from ..bodies import BODIES


def test_what_does_not_cross_itself_is_left_alone():
    assert untangled(BODIES["torus"]) is BODIES["torus"]


def test_a_vertex_pulled_through_the_body_comes_back():
    body = BODIES["ball"]
    spiked = body.vertices.copy()
    spike = int(np.argmax(body.vertices[:, 2]))
    spiked[spike] = [0.0, 0.1, -1.6]
    crossed = body.moved(spiked)
    assert crossing_triangles(crossed).any()
    result = untangled(crossed)
    assert not crossing_triangles(result).any()
    assert_array_equal(result.triangles, body.triangles)
    far = np.linalg.norm(body.vertices - body.vertices[spike], axis=1) > 1.0
    near_exit = np.linalg.norm(body.vertices - [0.0, 0.1, -1.0], axis=1) < 0.6
    assert_array_equal(result.vertices[far & ~near_exit], body.vertices[far & ~near_exit])
