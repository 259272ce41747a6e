import pytest

from refmesh_addon.pipeline.process.events import FINAL_KINDS, Event


def test_an_event_is_one_ascii_line_and_back():
    event = Event("warning", "Frame 7 fehlt:\nFüße", "tracking", 7, 0.25)
    line = event.to_line()
    assert line.isascii()
    assert "\n" not in line
    assert Event.from_line(line) == event


@pytest.mark.parametrize("line", ["", "noise of a library", "3", "[1]", "{}", '{"kind": "progress", "color": 1}', "null"])
def test_lines_that_are_no_events_are_passed_over(line):
    assert Event.from_line(line) is None


def test_only_the_ends_are_final():
    assert [kind for kind in ("progress", "warning", *FINAL_KINDS) if Event(kind).is_final] == ["done", "failed", "canceled"]
