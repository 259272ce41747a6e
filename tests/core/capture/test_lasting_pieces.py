"""Pieces about as large as what flies neither come and go with each frame, nor does noise of one frame stay."""

import numpy as np
import pytest

from refmesh_addon.core.capture.depth_artifacts import depth_artifacts
from refmesh_addon.core.capture.lasting_pieces import LEAST, doubtful_pieces, possible_surface, with_lasting_pieces
from refmesh_addon.core.geometry.mesh import triangle_areas

from ..shapes import joined, moved
from .test_depth_artifacts import sheet

PIECE = len(sheet(8).triangles)


def frame(share, shift=0.0):
    """The unit square, and a piece beside it with a share of its area."""
    return joined(sheet(40), moved(sheet(8), scale=np.sqrt(share), shift=(1.5 + shift, 0.3, 0.1)))


def flying(meshes, index):
    """Share of the triangles of the piece that fly in one of several frames, the neighbors being heard."""
    alone = [depth_artifacts(mesh) for mesh in meshes]
    others = [possible_surface(meshes[other], alone[other]) for other in (index - 1, index + 1) if 0 <= other < len(meshes)]
    return with_lasting_pieces(meshes[index], alone[index], others).flying[-PIECE:].mean()


def test_a_piece_about_the_limit_stays_in_all_frames():
    take = [frame(share) for share in (0.008, 0.012, 0.007, 0.013, 0.009)]
    alone = [depth_artifacts(mesh).flying[-PIECE:].mean() for mesh in take]
    assert min(alone) == 0.0 and max(alone) > 0.5, "by itself, each frame decides in its own way"
    assert [flying(take, index) for index in range(len(take))] == [0.0] * len(take)


@pytest.mark.parametrize(
    "take",
    [
        [sheet(40), frame(0.008), frame(0.008)],
        [frame(0.008, -1.0), frame(0.008), frame(0.008, 1.0)],
        [frame(0.4 * LEAST)] * 3,
    ],
    ids=["there once", "elsewhere", "speck"],
)
def test_what_does_not_last_or_is_too_small_flies(take):
    assert flying(take, 1) == 1.0


def test_a_frame_alone_is_as_it_was():
    mesh = frame(0.008)
    alone = depth_artifacts(mesh)
    assert np.array_equal(with_lasting_pieces(mesh, alone, []).any, alone.any)


def test_only_the_piece_comes_back_but_for_its_frayed_corners():
    mesh = frame(0.008)
    alone = depth_artifacts(mesh)
    steady = with_lasting_pieces(mesh, alone, [possible_surface(mesh, alone)] * 2)
    (piece,) = doubtful_pieces(mesh, alone)
    rest = np.setdiff1d(np.arange(len(mesh.triangles)), piece)
    assert np.array_equal(steady.any[rest], alone.any[rest])
    assert not (steady.flying & steady.frayed).any() and not steady.skirts[piece].any()
    kept = ~steady.any[piece]
    assert triangle_areas(mesh)[piece][kept].sum() > 0.8 * triangle_areas(mesh)[piece].sum()
