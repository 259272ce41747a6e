"""What is taken away from a depth capture: skirts, flying pieces and frayed borders, and nothing of a clean surface."""

import numpy as np
import pytest

from refmesh_addon.core.capture.depth_artifacts import depth_artifacts
from refmesh_addon.core.geometry.mesh import submesh, triangle_areas
from refmesh_addon.core.types import TriangleMesh

from ..shapes import TILT, ball, joined, moved


def sheet(count=24, height=lambda x, y: 0.0 * x, cut=None):
    """A grid of `count` squares a side over the unit square, seen from above; cut : (N, 2) rows and columns of squares that are missing."""
    x, y = np.meshgrid(*[np.linspace(0, 1, count + 1)] * 2, indexing="ij")
    vertices = np.stack([x, y, height(x, y)], axis=-1).reshape(-1, 3)
    number = np.arange(len(vertices)).reshape(x.shape)
    there = np.ones((count, count), dtype=bool)
    if cut is not None:
        there[tuple(np.transpose(cut))] = False
    a, b, c, d = (part[there] for part in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    return TriangleMesh(vertices, np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])]))


def two_depths():
    """A sheet with a step in the middle, as a triangulated depth image has it where one thing is before another."""
    return sheet(height=lambda x, y: np.where(x > 0.49, 0.5, 0.0))


@pytest.mark.parametrize("mesh", [sheet(), sheet(height=lambda x, y: 0.3 * np.sin(5 * x)), ball()], ids=["flat", "waves", "closed"])
def test_a_clean_surface_loses_nothing_but_corners(mesh):
    artifacts = depth_artifacts(mesh)
    assert triangle_areas(mesh)[artifacts.any].sum() < 0.01 * triangle_areas(mesh).sum()


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_the_skirt_across_a_depth_edge_goes_and_both_sides_stay(scale):
    mesh = moved(two_depths(), TILT, scale=scale)
    steep = np.ptp(two_depths().vertices[mesh.triangles][:, :, 2], axis=1) > 0.1
    artifacts = depth_artifacts(mesh)
    assert np.array_equal(artifacts.skirts, steep)
    assert artifacts.shares(triangle_areas(mesh))["skirts"] == pytest.approx(0.34, abs=0.02)


def test_a_small_piece_beside_the_surface_flies_and_a_large_one_does_not():
    small, large = (moved(sheet(4), scale=side, shift=(3, 0, 0)) for side in (0.05, 0.4))
    for piece, flies in ((small, True), (large, False)):
        flying = depth_artifacts(joined(sheet(), piece)).flying
        assert flying[-len(piece.triangles) :].all() == flies and not flying[: -len(piece.triangles)].any()


def test_many_small_pieces_together_are_the_capture():
    pieces = joined(*(moved(sheet(4), shift=(2.0 * number, 0, 0)) for number in range(120)))
    assert not depth_artifacts(pieces).any.any()


def test_a_spike_at_the_border_is_frayed_and_a_broad_part_is_not():
    cut = [(row, column) for row in range(20, 24) for column in range(24) if not (column == 3 or 10 <= column < 20)]
    mesh = sheet(cut=cut)
    frayed = depth_artifacts(mesh).frayed
    centers = mesh.vertices[mesh.triangles].mean(axis=1)
    spike = (centers[:, 0] > 21.5 / 24) & (centers[:, 1] < 0.3)
    broad = (centers[:, 0] > 0.5) & (centers[:, 1] > 12 / 24) & (centers[:, 1] < 18 / 24) & (centers[:, 0] < 22 / 24)
    assert frayed[spike].all() and not frayed[broad].any()
    kept = submesh(mesh, ~frayed)[0]
    assert triangle_areas(kept).sum() > 0.97 * triangle_areas(mesh).sum()


def test_a_surface_that_is_seen_edge_on_all_over_stays():
    steep = sheet(height=lambda x, y: 40.0 * np.round(3 * x))
    assert not depth_artifacts(steep).skirts.any()
