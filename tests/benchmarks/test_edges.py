"""Edges, rims and caps are measured where the source has them: exact for the body itself, and a known offset where it is moved."""

import numpy as np
import pytest

from benchmarks.edges import figures
from refmesh_addon.core.geometry.mesh import triangle_normals
from refmesh_addon.core.surfacing.hole_caps import smoothly_capped

from ..core.shapes import box, without

WHOLE = box((2.0, 2.0, 1.0), subdivisions=3)
SOURCE = smoothly_capped(without(WHOLE, triangle_normals(WHOLE) @ [0, 0, -1] > 0.9))


def test_the_body_itself_has_no_errors():
    exact = figures(SOURCE, WHOLE)
    assert max(exact["edges"] + exact["rims"]) < 0.02
    assert max(exact["cap"]) < 1e-6


def test_a_sole_that_sinks_is_measured_at_rim_and_cap():
    sunk = figures(SOURCE, WHOLE.moved(WHOLE.vertices - np.where(WHOLE.vertices[:, 2:] < -0.4, [0, 0, 0.03], 0.0)))
    assert sunk["rims"][0] == pytest.approx(1.0, abs=0.01)
    assert sunk["cap"][0] == pytest.approx(1.0, abs=0.01)


def test_a_crumpled_cap_is_rough():
    inside = (WHOLE.vertices[:, 2] < -0.4) & (np.abs(WHOLE.vertices[:, :2]) < 0.9).all(axis=1)
    bumps = 0.1 * inside[:, None] * np.random.default_rng(0).random((len(inside), 1)) * [0, 0, 1]
    assert figures(SOURCE, WHOLE.moved(WHOLE.vertices + bumps))["roughness"][0] > 5
