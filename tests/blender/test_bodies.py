"""Marking two bodies that touch all the time: by selected centers, one after the other."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from refmesh_addon.bridge.results.status import step_status
from refmesh_addon.core.reference.marks import parse_marks
from refmesh_addon.core.tracking.center_attributes import center_attributes
from refmesh_addon.io.files import write_npz
from refmesh_addon.io.pc2 import write_pc2

from .conftest import NUMBERS, write_results

GRID = np.stack(np.meshgrid(*[np.arange(3.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
POINTS = np.concatenate([GRID, GRID + [3.0, 0.0, 0.0]])  # two blocks of centers that touch
CENTERS = len(POINTS)


@pytest.fixture
def touching(blender, ball, frames, tmp_path):
    """The sequence with centers of two blocks that move as one."""
    out = write_results(tmp_path / "out", frames)
    positions = np.stack([POINTS + [0.0, 0.1 * number, 0.0] for number in NUMBERS])
    write_npz(out / "centers.npz", {"frames": np.array(NUMBERS), "positions": positions, **center_attributes(positions, 1.0)})
    write_pc2(out / "playback" / "centers-0.pc2", positions, CENTERS, len(NUMBERS))
    blender.ops.refmesh.load_results(output=str(out))
    return ball


def select(owner, indices) -> None:
    owner.refmesh.centers.data.vertices.foreach_set("select", np.isin(np.arange(CENTERS), indices))


def bodies(owner) -> np.ndarray:
    values = np.empty(CENTERS, dtype=np.float32)
    owner.refmesh.centers.data.attributes["body"].data.foreach_get("value", values)
    return values


def test_two_marks_show_two_bodies_and_make_the_reference_stale(blender, touching):
    assert len(set(bodies(touching))) == 1
    blender.context.scene.frame_set(8)
    for chosen in ([0, 4], [CENTERS - 1]):
        select(touching, chosen)
        blender.ops.refmesh.mark_body()
    marks = parse_marks(touching.refmesh.settings.apart)
    assert marks.frame == 8 and [len(points) for points in marks.bodies] == [2, 1]
    np.testing.assert_allclose(marks.bodies[0], POINTS[[0, 4]] + [0.0, 0.8, 0.0], rtol=1e-6)
    shown = bodies(touching)
    assert len(set(shown[:27])) == len(set(shown[27:])) == 1 and shown[0] != shown[-1]
    assert touching.refmesh.center_color == "BODY" and touching.refmesh.center_range == "2 bodies"
    kinds = [step_status(touching.refmesh, stage) for stage in ("tracking", "reference")]
    assert kinds[0].kind == "current" and kinds[1].text == "out of date: other bodies are marked to be apart"


def test_marks_are_added_moved_to_another_body_and_forgotten(blender, touching):
    count = lambda: [len(points) for points in parse_marks(touching.refmesh.settings.apart).bodies]
    for chosen, body, expected in (([0, 1], 0, [2]), ([50, 2], 0, [2, 2]), ([2, 3], 1, [4, 1]), ([1], 2, [3, 2])):
        select(touching, chosen)
        blender.context.scene.frame_set(6 + len(expected))  # later marks join the frame of the first
        blender.ops.refmesh.mark_body(body=body)
        assert count() == expected and parse_marks(touching.refmesh.settings.apart).frame == 7
    blender.ops.refmesh.forget_body(body=1)
    assert count() == [2]
    blender.ops.refmesh.forget_body(body=1)
    assert touching.refmesh.settings.apart == "" and len(set(bodies(touching))) == 1


def test_selected_in_edit_mode_it_need_not_be_left(blender, touching):
    blender.context.view_layer.objects.active = touching.refmesh.centers
    blender.ops.object.mode_set(mode="EDIT")
    blender.ops.mesh.select_all(action="SELECT")
    blender.ops.refmesh.mark_body()
    assert blender.context.mode == "EDIT_MESH"
    assert blender.ops.refmesh.show_trails() == {"FINISHED"}
    blender.ops.object.mode_set(mode="OBJECT")
    assert len(parse_marks(touching.refmesh.settings.apart).bodies[0]) == CENTERS
    assert not touching.refmesh.centers.data.vertices[0].select  # the next body begins with none


def test_presets_and_new_results_keep_the_marks(blender, touching):
    for chosen in ([0], [CENTERS - 1]):
        select(touching, chosen)
        blender.ops.refmesh.mark_body()
    text = touching.refmesh.settings.apart
    blender.ops.refmesh.apply_preset(preset="draft")
    assert touching.refmesh.settings.apart == text and touching.refmesh.settings.matching_preset() == "draft"


@pytest.mark.parametrize(
    "operator, arguments, change, message",
    [
        ("mark_body", {}, lambda owner: None, "select some of one body in edit mode"),
        ("mark_body", {"body": 1}, lambda owner: select(owner, [0]), "no such marked body; none marked so far"),
        ("forget_body", {"body": 2}, lambda owner: select(owner, [0]), "no such marked body"),
        ("forget_body", {}, lambda owner: None, "no such marked body"),
        ("mark_body", {}, lambda owner: setattr(owner.refmesh.settings, "apart", "six"), "'six' is not a frame"),
        ("mark_body", {}, lambda owner: bpy.data.objects.remove(owner.refmesh.centers), "run the Track step first"),
    ],
)
def test_what_cannot_be_marked_is_said(blender, touching, operator, arguments, change, message):
    select(touching, [])
    change(touching)
    before = touching.refmesh.settings.apart
    with pytest.raises(RuntimeError, match=message):
        getattr(blender.ops.refmesh, operator)(**arguments)
    assert touching.refmesh.settings.apart == before


def test_centers_that_are_gone_are_named(blender, touching, tmp_path):
    select(touching, [0])
    (tmp_path / "out" / "centers.npz").unlink()
    with pytest.raises(RuntimeError, match="centers.npz: cannot be read"):
        blender.ops.refmesh.mark_body()
    assert touching.refmesh.settings.apart == ""
