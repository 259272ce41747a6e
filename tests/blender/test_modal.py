"""What cancels a job that runs beside Blender, and what does not."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from refmesh_addon.operators.modal import over_progress
from refmesh_addon.operators.progress import ASK_AFTER, Clock


def region(kind: str, x: int, y: int, width: int, height: int, tab: str = "UNSUPPORTED"):
    return SimpleNamespace(type=kind, x=x, y=y, width=width, height=height, active_panel_category=tab)


def window(tab: str):
    """A 3D view with a sidebar above a timeline above the status bar, which takes the lowest 22 pixels."""
    sidebar = region("UI", 700, 200, 300, 500, tab)
    view = SimpleNamespace(type="VIEW_3D", y=200, regions=[region("WINDOW", 0, 200, 1000, 500), sidebar])
    timeline = SimpleNamespace(type="DOPESHEET_EDITOR", y=22, regions=[region("UI", 900, 22, 100, 178, "View")])
    return SimpleNamespace(screen=SimpleNamespace(areas=[view, timeline]))


@pytest.mark.parametrize(
    "tab, x, y, expected",
    [
        ("RefMesh", 750, 300, True),
        ("RefMesh", 699, 300, False),  # in the view, beside the sidebar
        ("Item", 750, 300, False),  # another add-on's tab
        ("RefMesh", 950, 100, False),  # the sidebar of the timeline
        ("RefMesh", 500, 10, True),  # the status bar
        ("RefMesh", 500, 30, False),
    ],
)
def test_escape_is_meant_for_the_job_where_its_progress_is_shown(tab, x, y, expected):
    assert over_progress(window(tab), x, y) is expected


def test_a_job_asks_before_it_is_canceled_once_it_has_run_for_a_while(monkeypatch):
    clock, event = Clock(), SimpleNamespace(stage="tracking", frame=8, share=0.25)
    assert clock.at_stake(event) == ""
    monkeypatch.setattr(clock, "_start", clock._start - ASK_AFTER)
    assert clock.at_stake(event).startswith("25% is done. What is finished is kept")


@pytest.mark.parametrize("operator", ["import_object", "run_all", "check_sequence", "load_results"])
def test_closing_the_dialog_before_a_job_ends_nothing(blender, operator):
    """Blender calls `cancel` of an operator whose dialog is closed, before anything of the job is there."""
    name = f"REFMESH_OT_{operator}"
    stub = SimpleNamespace(_frames=None, _worker=None, _timer=None, show_status=None)
    cls = next(cls for cls in _operator_classes() if cls.__name__ == name)
    stub.end_modal = lambda context: cls.end_modal(stub, context)
    cls.cancel(stub, blender.context)


def _operator_classes():
    from refmesh_addon.operators import CLASSES

    return CLASSES
