"""Cloth that a fit has stretched here and squeezed beside it slides until it has its lengths, on the source, and only there."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.core.deformation.arap import ArapSolver
from refmesh_addon.core.deformation.correspondence import Correspondence, SurfaceIndex, SurfaceSampler
from refmesh_addon.core.deformation.strain_relief import SQUEEZED, STRETCHED, StrainRelief
from refmesh_addon.core.geometry.stretch import RestShape
from refmesh_addon.core.types import TriangleMesh

from ..shapes import STILL, TILT, moved

COLUMNS, ROWS = 48, 24
WIDTH = 2.0


def cloth() -> TriangleMesh:
    x, y = np.meshgrid(np.linspace(0, WIDTH, COLUMNS), np.linspace(0, 1, ROWS), indexing="ij")
    corner = (np.arange(COLUMNS - 1)[:, None] * ROWS + np.arange(ROWS - 1)).ravel()
    quads = corner[:, None] + [0, ROWS, ROWS + 1, 1]
    vertices = np.column_stack([x.ravel(), y.ravel(), 0.1 * np.sin(4 * x.ravel())])
    return TriangleMesh(vertices, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]))


CLOTH = cloth()
FLAT = CLOTH.vertices[:, 0]
EVERYTHING, NOTHING = (np.full(len(FLAT), value) for value in (True, False))


def misplaced() -> np.ndarray:
    """(R, 3) the cloth on itself, squeezed to a fifth in one part and stretched to more than twice its length in the next."""
    x = np.interp(FLAT, [0.6, 1.1, 1.4], [0.6, 0.7, 1.4])
    x = np.where((FLAT > 0.6) & (FLAT < 1.4), x, FLAT)
    return np.column_stack([x, CLOTH.vertices[:, 1], 0.1 * np.sin(4 * x)])


def relieved(vertices: np.ndarray, visible=EVERYTHING, still=NOTHING, place=(STILL, 0.0, 1.0)) -> np.ndarray:
    turn, shift, scale = place
    mesh, source = moved(CLOTH, scale=scale), moved(CLOTH, turn, np.full(3, shift), scale)
    correspondence = Correspondence(SurfaceIndex(source), SurfaceSampler(mesh))
    start = moved(CLOTH.moved(vertices), turn, np.full(3, shift), scale).vertices
    result = StrainRelief(ArapSolver(mesh), still).relieved(start, correspondence, visible)
    return (result - shift) @ turn / scale


def test_strained_cloth_gets_its_lengths_and_stays_on_the_source():
    result, rest = relieved(misplaced()), RestShape(CLOTH)
    largest, smallest = rest.factors(result)
    assert rest.stretches(misplaced()).max() > STRETCHED > 1.7 > largest.max()
    assert rest.factors(misplaced())[1].min() < SQUEEZED < 0.5 < smallest.min()
    assert SurfaceIndex(CLOTH).query(result).distances.max() < 2e-3
    assert_array_equal(result[FLAT < 0.25], CLOTH.vertices[FLAT < 0.25])


def test_what_is_hidden_or_on_a_line_or_hardly_strained_stays():
    start = misplaced()
    assert_array_equal(relieved(start, visible=NOTHING), start)
    assert_array_equal(relieved(start, still=EVERYTHING), start)
    still = FLAT > 1.0
    assert_array_equal(relieved(start, still=still)[still], start[still])
    assert_array_equal(relieved(CLOTH.vertices), CLOTH.vertices)


@pytest.mark.parametrize("place", [(TILT, 0.0, 1.0), (STILL, 300.0, 1.0), (STILL, 0.0, 1e3)], ids=["turned", "far", "large"])
def test_place_and_scale_change_nothing(place):
    assert np.abs(relieved(misplaced(), place=place) - relieved(misplaced())).max() < 5e-4
