"""Caps of the reference mesh go to those of a frame: a sole is flat in the frame's own rim, whatever bulge it had before."""

import numpy as np

from refmesh_addon.core.deformation.arap import ArapSolver
from refmesh_addon.core.deformation.cap_targets import CapTargets
from refmesh_addon.core.deformation.correspondence import Correspondence, SurfaceIndex, SurfaceSampler
from refmesh_addon.core.deformation.partners import Limits
from refmesh_addon.core.deformation.surface_fit import NOTHING, Unpaired, fit_surface
from refmesh_addon.core.geometry.cotangent import triangle_adjacency
from refmesh_addon.core.geometry.mesh import mean_edge_length, triangle_normals
from refmesh_addon.core.surfacing.hole_caps import smoothly_capped, without_holes
from refmesh_addon.core.types import TriangleMesh

from ..shapes import TILT, ball, box, moved

SIDES = np.array([2.0, 1.2, 0.8])
BOX = box(SIDES, subdivisions=4)
REFERENCE = moved(BOX, TILT)
LENGTH = mean_edge_length(REFERENCE)
CAPS = np.flatnonzero(BOX.vertices[:, 2] < -SIDES[2] / 2 + 1e-9)
FLOOR = 0.98  # share of the height at which the frame is cut off


def frame() -> TriangleMesh:
    """The box without its bottom, cut off higher up."""
    cut = BOX.vertices * [1.0, 1.0, FLOOR] + [0.0, 0.0, SIDES[2] * (1 - FLOOR) / 2]
    return moved(TriangleMesh(cut, BOX.triangles[triangle_normals(BOX)[:, 2] > -0.5]), TILT)


def heights(points: np.ndarray) -> np.ndarray:
    """Of points below the rim of the frame, in mean edge lengths."""
    return (SIDES[2] * (0.5 - FLOOR) - (points @ TILT)[:, 2]) / LENGTH


NEVER = np.zeros(len(REFERENCE.vertices), dtype=bool)


def targets(mesh: TriangleMesh = REFERENCE, source: TriangleMesh | None = None, paired: np.ndarray = NEVER):
    caps = CapTargets(CAPS, triangle_adjacency(REFERENCE), smoothly_capped(source or frame()))
    return caps.pairs(mesh, Limits(3 * LENGTH, 0.5), paired)


def test_the_fit_of_a_sole_is_flat_and_does_not_stand_below_the_rim():
    bulging = REFERENCE.vertices.copy()
    bulging[CAPS] -= 0.4 * LENGTH * np.cos(np.pi * (BOX.vertices[CAPS, :1] / SIDES[0])) * TILT[:, 2]
    correspondence = Correspondence(SurfaceIndex(frame()), SurfaceSampler(REFERENCE))
    fitted = lambda unpaired: heights(fit_surface(ArapSolver(REFERENCE), bulging, correspondence, unpaired=unpaired).vertices)
    caps = CapTargets(CAPS, triangle_adjacency(REFERENCE), smoothly_capped(frame()))
    with_caps, without = fitted(Unpaired(caps=caps)), fitted(NOTHING)
    assert with_caps.max() < 0.05 < 0.3 < without.max()
    assert np.abs(with_caps[CAPS]).max() < 0.1


def test_targets_lie_on_the_cap_and_walls_count_only_beyond_it():
    pairs = targets()
    vertices = pairs.corners[:, 0]
    assert np.isin(CAPS[np.abs(BOX.vertices[CAPS, :2]).max(axis=1) < 0.5], vertices).all()
    assert np.abs(heights(pairs.targets)).max() < 1e-9
    assert (heights(REFERENCE.vertices[np.setdiff1d(vertices, CAPS)]) > 0).all()


def test_a_wall_that_was_pulled_in_keeps_its_target():
    sunk = REFERENCE.moved(REFERENCE.vertices - 1.5 * LENGTH * TILT[:, 2])
    before = targets(sunk)
    walls = np.setdiff1d(before.corners[:, 0], CAPS)
    assert len(walls) > 10
    pulled_in = sunk.vertices.copy()
    pulled_in[walls] += (heights(pulled_in[walls]) + 0.05)[:, None] * LENGTH * TILT[:, 2]
    assert not np.isin(walls, targets(sunk.moved(pulled_in)).corners[:, 0]).any()
    paired = NEVER.copy()
    paired[before.corners[:, 0]] = True
    assert np.isin(walls, targets(sunk.moved(pulled_in), paired=paired).corners[:, 0]).all()


def test_a_cap_turned_away_or_far_off_and_a_frame_without_holes_give_no_targets():
    upside_down = REFERENCE.moved(REFERENCE.vertices - 2 * (REFERENCE.vertices @ TILT)[:, 2:] * TILT[:, 2])
    assert not len(targets(upside_down).corners)
    assert not len(targets(REFERENCE.moved(REFERENCE.vertices + [0, 9, 0])).corners)
    whole = CapTargets(CAPS, triangle_adjacency(REFERENCE), without_holes(ball(2)))
    assert not len(whole.pairs(REFERENCE, Limits(9.0, 0.5), NEVER).corners)
