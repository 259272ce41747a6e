"""The first and the last frame of a take: what they lack or have twice is named, and nothing that may have come, left or moved."""

import numpy as np
import pytest

from refmesh_addon.core.capture.bad_frames import bad_frames
from refmesh_addon.core.capture.pieces import Pieces, pieces_of
from refmesh_addon.core.types import TriangleMesh

from .test_bad_frames import COUNT, surface, take

FAR = (-1.4, 1.0, 1.2)
ENDS = [0, COUNT - 1]


def at(end: int) -> int:
    """The frame beside an end."""
    return 1 if end == 0 else COUNT - 2


def doubled(mesh: TriangleMesh) -> Pieces:
    copy = mesh.vertices + [0.2, 1.2, 0.0]
    return pieces_of(TriangleMesh(np.concatenate([mesh.vertices, copy]), np.concatenate([mesh.triangles, mesh.triangles + len(copy)])))


@pytest.mark.parametrize("end", ENDS)
def test_a_limb_that_is_lost_is_named_with_the_frame_beside(end):
    (found,) = bad_frames(take({end: {"arm": None}}))
    assert (found.index, found.before, found.after) == (end, at(end), at(end))
    assert "of the surface is missing" in found.reason
    assert np.linalg.norm(found.place - (0.9, 0.0, 0.6)) < 0.35


@pytest.mark.parametrize("end", ENDS)
def test_a_copy_of_the_body_and_a_body_that_has_leapt_are_named(end):
    frames = take()
    frames[end] = doubled(surface(end))
    assert [(bad.index, "in excess" in bad.reason) for bad in bad_frames(frames)] == [(end, True)]
    (found,) = bad_frames(take({end: {"at": FAR}}))
    assert found.index == end and "of the diagonal away" in found.reason
    assert np.linalg.norm(found.place - FAR) < 0.35


@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize("change", [{"at": None}, {"arm": 1.2}, {"at": (1.2, 0.4, -0.7)}], ids=["a body that comes", "swing", "step"])
def test_a_body_that_comes_or_leaves_and_motion_are_no_fault(end, change):
    assert not bad_frames(take({end: change}))


@pytest.mark.parametrize("end", ENDS)
def test_a_take_that_begins_or_ends_in_another_place_is_no_fault(end):
    frames = take(at=None)
    frames[end] = pieces_of(TriangleMesh(surface(end, at=None).vertices + [9.0, 0.0, 0.0], surface(end, at=None).triangles))
    assert not bad_frames(frames)


def test_nothing_is_said_where_the_frames_beside_change_themselves_or_are_too_few():
    swinging = {step: {"arm": 0.5 * step} for step in range(1, 4)}
    assert not bad_frames(take({0: {"arm": None}, **swinging}))
    assert not bad_frames(take({0: {"arm": None}}, count=3))
    assert [bad.index for bad in bad_frames(take({0: {"arm": None}}, count=4))] == [0]


def test_an_end_and_a_frame_near_it_are_judged_each_by_itself():
    assert [bad.index for bad in bad_frames(take({0: {"arm": None}, 5: {"at": None, "arm": None}}))] == [0, 5]
