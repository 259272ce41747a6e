"""Pieces about as large as what flies neither come and go with each frame, nor does noise of one frame stay."""

import numpy as np
import pytest

from refmesh_addon.core.capture.depth_artifacts import depth_artifacts
from refmesh_addon.core.capture.lasting_pieces import LEAST, LEAST_SQUARES, WINDOW, possible_surface, with_lasting_pieces
from refmesh_addon.core.geometry.mesh import mean_edge_length, triangle_areas
from refmesh_addon.core.types import TriangleMesh

from ..shapes import TILT, joined, moved
from .test_depth_artifacts import sheet

PIECE = len(sheet(8).triangles)
ALONE = sheet(80)


def frame(share, shift=0.0):
    """The unit square, and a piece beside it with a share of its area."""
    return joined(ALONE, moved(sheet(8), scale=np.sqrt(share), shift=(1.5 + shift, 0.3, 0.1)))


ATTACHED = joined(ALONE, moved(sheet(40), scale=0.5, shift=(1.3, 0.0, 0.1)))  # in which the piece is part of a large one


def artifacts(meshes, index):
    """Of one of several frames, with what the frames around it say."""
    alone = [depth_artifacts(mesh) for mesh in meshes]
    possible = [possible_surface(mesh, own) for mesh, own in zip(meshes, alone, strict=True)]
    around = [(other - index, possible[other]) for other in range(len(meshes)) if 0 < abs(other - index) <= WINDOW]
    return with_lasting_pieces(meshes[index], alone[index], possible[index], around)


def flying(meshes, index):
    """Share of the triangles of the piece that fly in one of several frames."""
    return artifacts(meshes, index).flying[-PIECE:].mean()


def test_a_piece_about_the_limit_stays_in_all_frames():
    take = [frame(share) for share in (0.008, 0.012, 0.004, 0.013, 0.009)]
    alone = [depth_artifacts(mesh).flying[-PIECE:].mean() for mesh in take]
    assert min(alone) == 0.0 and max(alone) > 0.5, "by itself, each frame decides in its own way"
    assert [flying(take, index) for index in range(len(take))] == [0.0] * len(take)


def test_a_piece_that_one_frame_loses_stays_on_both_sides_of_it():
    take = [frame(0.008), frame(0.008), ALONE, frame(0.008), frame(0.008)]
    assert [flying(take, index) for index in (0, 1, 3, 4)] == [0.0] * 4


def test_a_piece_stays_in_the_frame_before_it_joins_the_body():
    take = [ALONE, ALONE, frame(0.008), ATTACHED, ATTACHED]
    assert flying(take, 2) == 0.0 and flying(take[::-1], 2) == 0.0
    assert flying([ALONE, ALONE, frame(0.008), ALONE, ATTACHED], 2) == 1.0


@pytest.mark.parametrize(
    "take",
    [
        [ALONE, ALONE, frame(0.008), ALONE, ALONE],
        [frame(0.008, shift) for shift in (-2.0, -1.0, 0.0, 1.0, 2.0)],
        [frame(0.5 * LEAST)] * 5,
        [frame(0.008)],
    ],
    ids=["there once", "elsewhere", "speck", "one frame"],
)
def test_what_does_not_last_or_is_too_small_flies(take):
    assert flying(take, len(take) // 2) == 1.0


def test_noise_beside_a_rim_that_stays_is_no_part_of_it():
    beside = joined(ALONE, moved(sheet(8), scale=np.sqrt(0.008), shift=(1.01, 0.3, 0.0)))
    assert flying([ALONE, ALONE, beside, ALONE, ALONE], 2) == 1.0


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_size_place_and_order_of_triangles_do_not_matter(scale):
    take = [frame(share) for share in (0.008, 0.004, 0.012)]
    order = np.random.default_rng(0).permutation(len(take[0].triangles))
    other = [TriangleMesh(mesh.vertices, mesh.triangles[order]) for mesh in (moved(one, TILT, scale=scale) for one in take)]
    assert np.array_equal(artifacts(other, 1).any, artifacts(take, 1).any[order])


def test_pieces_of_a_few_pixels_are_noise_in_a_fine_capture_as_well():
    tiny = joined(ALONE, moved(sheet(3), scale=3 / 80, shift=(1.5, 0.3, 0.1)))
    area = triangle_areas(tiny)[-18:].sum()
    assert LEAST < area < LEAST_SQUARES * mean_edge_length(tiny) ** 2
    assert artifacts([tiny] * 3, 1).flying[-18:].all()


def test_a_frame_alone_is_as_it_was():
    mesh = frame(0.008)
    alone = depth_artifacts(mesh)
    assert np.array_equal(with_lasting_pieces(mesh, alone, possible_surface(mesh, alone), []).any, alone.any)


def test_only_the_piece_comes_back_but_for_its_frayed_corners():
    mesh = frame(0.008)
    alone, steady = depth_artifacts(mesh), artifacts([mesh] * 3, 1)
    (piece,) = possible_surface(mesh, alone).pieces
    rest = np.setdiff1d(np.arange(len(mesh.triangles)), piece)
    assert np.array_equal(steady.any[rest], alone.any[rest])
    assert not (steady.flying & steady.frayed).any() and not steady.skirts[piece].any()
    kept = ~steady.any[piece]
    assert triangle_areas(mesh)[piece][kept].sum() > 0.8 * triangle_areas(mesh)[piece].sum()
