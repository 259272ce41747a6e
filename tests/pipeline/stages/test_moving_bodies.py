"""Bodies that only motion shows apart, in a run: followed anew, named in the report, and resumed. What shows them is tested in the core."""

import numpy as np
import pytest

from refmesh_addon.core.reference.bodies_by_motion import TakeBodies
from refmesh_addon.pipeline.stages import moving_bodies

from ..conftest import FRAMES, TINY
from ..running import cache_entries, finish, remade, report, results

DEFAULTS = {"until": "tracking", **{name: getattr(TINY.tracking, name) for name in ("centers", "resolution")}}


def divided(positions, spacing, known, start) -> TakeBodies:
    """The first ball as two bodies, upper and lower half."""
    first = known.bodies[0]
    bodies = np.where((known.bodies == first) & (positions[0, :, 2] > 0), 2, known.bodies)
    by_motion = np.arange(3) != 1 - first
    return TakeBodies(bodies, np.where(by_motion[:, None], [[0, 2]], [[1, 1]]), by_motion, by_motion)


@pytest.fixture
def tracked(two_balls, tmp_path, monkeypatch):
    monkeypatch.setattr(moving_bodies, "bodies_by_motion", divided)
    return tmp_path / "out", finish(two_balls, tmp_path / "out", **DEFAULTS)


def test_such_bodies_are_followed_each_by_itself_and_named_with_their_frames(tracked):
    output, warnings = tracked
    bodies = report(output)["bodies"]
    assert sorted(body["by_motion"] for body in bodies) == [False, True, True]
    assert [body["frames"] for body in bodies if body["by_motion"]] == [[FRAMES[0], FRAMES[-1]]] * 2
    assert sum(body["centers"] for body in bodies) == TINY.tracking.centers
    assert [line for line in warnings if "2 bodies touch in the first frame" in line]
    with np.load(output / "centers.npz") as centers:
        assert len(np.unique(centers["body"])) == 3


def test_a_second_run_tracks_nothing_anew(two_balls, tracked):
    output, _ = tracked
    before, entries = results(output), cache_entries(output)
    assert {"tracking/frame_0003", "tracking/apart_frame_0003", "tracking/apart_state"} <= entries.keys()
    finish(two_balls, output, **DEFAULTS)
    assert not remade(entries, cache_entries(output))
    assert results(output) == before


def test_bodies_with_a_gap_are_named_by_the_frame_of_the_widest(finished):
    bodies = report(finished)["bodies"]
    assert [body["frames"] for body in bodies] == [[FRAMES[0]] * 2] * 2
    assert not any(body["by_motion"] for body in bodies)
