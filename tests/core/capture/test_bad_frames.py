"""Frames in which something is lost, doubled or leaps away for a moment: found with their place, and no motion taken for one."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from refmesh_addon.core.capture.bad_frames import LONGEST, bad_frames
from refmesh_addon.core.capture.pieces import Pieces, pieces_of
from refmesh_addon.core.types import TriangleMesh
from sample_scenes.generators.shapes import ball, block, capsule, union
from sample_scenes.generators.surface import iso_surface

COUNT = 9
BALL = (1.2, 0.0, -0.7)


@cache
def surface(step: int, arm: float | None = 0.0, at: tuple | None = BALL) -> TriangleMesh:
    """A trunk that moves on, its arm at an angle, and a ball beside it; None for what is not there."""
    here = np.array([0.02 * step, 0.0, 0.0])
    parts = [block(here, (0.35, 0.3, 0.9), 0.1)]
    if arm is not None:
        parts.append(capsule(here + [0.0, 0.0, 0.6], here + [1.1 * np.cos(arm), 1.1 * np.sin(arm), 0.6], 0.16))
    if at is not None:
        parts.append(ball(here + at, 0.3))
    return iso_surface(union(*parts), np.zeros(3), 2.6, 0.1, np.random.default_rng(step))


def take(changes: dict | None = None, count: int = COUNT, **always) -> list[Pieces]:
    """Pieces of each frame.  changes : step -> what is different there."""
    return [pieces_of(surface(step, **{**always, **(changes or {}).get(step, {})})) for step in range(count)]


def indices(frames: list[Pieces]) -> list[int]:
    return [bad.index for bad in bad_frames(frames)]


@pytest.mark.parametrize("lost", [{"arm": None}, {"at": None}, {"at": (-1.3, 0.9, 0.8)}], ids=["limb", "body", "leap"])
@pytest.mark.parametrize("steps", [(4,), (3, 4)])
def test_what_is_lost_for_a_moment_is_named(lost, steps):
    found = bad_frames(take(dict.fromkeys(steps, lost)))
    assert [bad.index for bad in found] == list(steps)
    assert {(bad.before, bad.after) for bad in found} == {(steps[0] - 1, steps[-1] + 1)}
    assert all("of the surface is missing" in bad.reason for bad in found)
    place = (0.9, 0.0, 0.6) if "arm" in lost else BALL
    assert np.linalg.norm(found[0].place - place) < 0.35


def test_a_copy_of_the_body_is_in_excess():
    frames, mesh = take(), surface(4)
    shifted = np.concatenate([mesh.vertices, mesh.vertices + [0.2, 1.2, 0.0]])
    frames[4] = pieces_of(TriangleMesh(shifted, np.concatenate([mesh.triangles, mesh.triangles + len(mesh.vertices)])))
    (found,) = bad_frames(frames)
    assert found.index == 4 and "in excess" in found.reason


def test_volume_alone_can_jump():
    frames = take()
    frames[4] = replace(frames[4], volumes=1.3 * frames[4].volumes)
    (found,) = bad_frames(frames)
    assert found.index == 4 and "30% more volume" in found.reason


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {4: {"arm": 0.9}},
        {step: {"arm": None} for step in range(4, COUNT)},
        {step: {"arm": None} for step in range(4)},
        {4: {"arm": 1.2, "at": (1.2, 0.5, -0.7)}},
    ],
    ids=["motion", "swing", "gone", "late", "jerk"],
)
def test_motion_and_what_lasts_is_not_bad(changes):
    assert indices(take(changes)) == []


def test_a_ball_that_bounces_is_not_bad():
    heights = {2: 1.5, 3: 0.4, 4: -0.7, 5: 0.4, 6: 1.5}
    assert indices(take({step: {"at": (1.2, 0.0, height)} for step, height in heights.items()})) == []


def test_a_prop_that_is_seen_once_is_none_of_a_bad_frame():
    assert indices(take({4: {"at": BALL}}, at=None)) == []


def test_a_frame_in_another_unit_is_none_of_a_moment():
    frames = take()
    frames[4] = pieces_of(TriangleMesh(10.0 * surface(4).vertices, surface(4).triangles))
    assert indices(frames) == []


def test_more_than_a_moment_is_a_change():
    lost = lambda length: take({step: {"arm": None} for step in range(2, 2 + length)}, count=LONGEST + 6)
    assert indices(lost(LONGEST)) == list(range(2, 2 + LONGEST))
    assert indices(lost(LONGEST + 1)) == []


def test_scale_changes_nothing():
    frames = take({4: {"arm": None}})
    powers = {"volumes": 3, "areas": 2, "queries": 1, "samples": 1}
    scaled = [replace(one, **{name: 1e3**power * getattr(one, name) for name, power in powers.items()}) for one in frames]
    (found,), (large,) = bad_frames(frames), bad_frames(scaled)
    assert (large.index, large.reason) == (found.index, found.reason)
    assert_allclose(large.place, 1e3 * found.place)
