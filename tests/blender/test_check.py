"""The check of a sequence as the panel shows it."""

from __future__ import annotations

import bpy
import pytest


@pytest.fixture
def checked(blender, ball, frames, tmp_path):
    (frames / "ball_0008.obj").write_text("this is no mesh")
    (frames / "ball_0011.obj").write_bytes((frames / "ball_0010.obj").read_bytes())
    blender.ops.refmesh.check_sequence(output=str(tmp_path / "out"), quiet=True)
    return ball.refmesh


def test_findings_are_listed_and_a_click_goes_to_the_frame(checked):
    findings = [(item.name, item.severity) for item in checked.findings if item.severity != "note"]
    assert findings == [("8", "error"), ("8", "warning"), ("11", "warning")]  # 8 is also held over the missing 9
    for index, item in enumerate(checked.findings):
        checked.active_finding = index
        assert bpy.context.scene.frame_current == int(item.name)


def test_checking_makes_no_objects_and_no_results(checked):
    assert {member.name for member in bpy.data.objects} == {"ball", "ball source"}
    assert not checked.done and checked.checked


def test_a_second_check_shows_what_was_put_right(blender, checked, frames):
    (frames / "ball_0008.obj").write_bytes((frames / "ball_0007.obj").read_bytes())
    blender.ops.refmesh.check_sequence(quiet=True)
    assert [(item.name, item.severity) for item in checked.findings if item.severity == "error"] == []
    assert [item.name for item in checked.findings if "identical to frame" in item.message] == ["8", "11"]
