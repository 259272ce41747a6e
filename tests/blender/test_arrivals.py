"""Groups that are shown while the job that makes them goes on."""

from __future__ import annotations

import time

import numpy as np
import pytest

from refmesh_addon.bridge.results.arriving import read_group, show_group
from refmesh_addon.bridge.scene.meshes import read_positions
from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.operators.arrivals import Arrivals

from .conftest import GROUPS, place, reference


def test_a_group_plays_as_soon_as_it_is_there(blender, ball, results):
    assert show_group(ball, read_group(results, 1)) == ""
    groups = ball.refmesh.groups
    assert [group.start for group in groups] == [numbers[0] for numbers in GROUPS]
    assert not ball.refmesh.show_reference, "it would stand in the result"
    assert groups[0].deformed is None and not ball.refmesh.done
    blender.context.scene.frame_set(11)
    shown = groups[1].deformed.evaluated_get(blender.context.evaluated_depsgraph_get())
    assert groups[1].deformed.visible_get()
    np.testing.assert_allclose(read_positions(shown.data), place(reference(1).vertices, 11), atol=1e-5)
    blender.context.scene.frame_set(6)
    assert not groups[1].deformed.visible_get() and ball.visible_get()


def test_all_results_take_over_what_is_shown_already(blender, ball, results):
    show_group(ball, read_group(results, 0))
    shown = ball.refmesh.groups[0].deformed
    blender.ops.refmesh.load_results(output=str(results))
    assert ball.refmesh.groups[0].deformed == shown and ball.refmesh.groups[1].deformed is not None


def test_groups_are_handed_out_once_they_are_read_and_broken_ones_are_left_to_the_end(results):
    arrivals = Arrivals(results)
    assert arrivals.next() is None
    (results / "reference" / "group_000.ply").write_bytes(b"not a mesh")
    arrivals.add(0)
    arrivals.add(1)
    end = time.monotonic() + 30
    while (arrived := arrivals.next()) is None:
        assert time.monotonic() < end
        time.sleep(0.01)
    assert arrived.index == 1
    arrivals.close()
    with pytest.raises(RefMeshError):
        read_group(results, 0)
