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
    clock = Clock()
    clock.hear(SimpleNamespace(stage="tracking", frame=8, share=0.25, left=None))
    assert clock.at_stake() == ""
    monkeypatch.setattr(clock, "_start", clock._start - ASK_AFTER)
    assert clock.at_stake().startswith("25% is done. What is finished is kept")


@pytest.fixture
def shown(monkeypatch):
    """shown(events): share and time left, each second, of a clock that hears each event (second, share, left) in its second."""

    def follow(events, seconds):
        now = 0.0
        monkeypatch.setattr("refmesh_addon.operators.progress.time.monotonic", lambda: now)
        clock, heard, states = Clock(), dict((second, rest) for second, *rest in events), []
        for second in range(seconds):
            now = float(second)
            if second in heard:
                share, left = heard[second]
                clock.hear(SimpleNamespace(stage="reference", frame=None, share=share, left=left))
            clock.move()
            states.append((clock.share, clock._left))
        return states

    return follow


@pytest.mark.parametrize(
    "events",
    [
        [(0, 0.0, 100.0)],  # no news for the whole job
        [(0, 0.0, 50.0), (10, 0.05, 300.0), (60, 0.2, 250.0)],  # much slower than it seemed
        [(0, 0.1, 300.0), (30, 0.8, 20.0)],  # a stage that was done already
        [(0, 0.0, None), (20, 0.1, 90.0), (40, 0.12, 95.0)],  # nothing known at first
    ],
)
def test_time_left_never_grows_and_the_bar_always_moves(shown, events):
    states = shown(events, 100)
    known = [left for _, left in states if left is not None]
    shares = [share for share, left in states if left is not None]
    assert all(later < earlier for earlier, later in zip(known, known[1:]))
    assert all(later > earlier for earlier, later in zip(shares, shares[1:])) and shares[-1] < 1


def test_a_job_that_takes_far_longer_than_it_seemed_says_so():
    """The bar moves on slowly; the words do not say that there is next to nothing left."""
    clock = Clock()
    clock.hear(SimpleNamespace(stage="color", frame=None, share=0.9, left=4.5))
    assert clock.time_left == "0:04 left"
    clock.hear(SimpleNamespace(stage="color", frame=None, share=0.5, left=200.5))
    assert clock.time_left == "3:20 left, longer than expected"
    clock.hear(SimpleNamespace(stage="color", frame=None, share=0.99, left=3.0))
    assert clock.time_left.endswith(" left")


def test_an_estimate_that_is_right_counts_down_second_by_second(shown):
    events = [(second, second / 100, 100.0 - second) for second in range(100)]
    states = shown(events, 100)
    assert [left for _, left in states] == pytest.approx([100.0 - second for second in range(100)], abs=1.0)


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
