"""Frames with one thing wrong each: that thing is found, there, and nothing else is."""

import numpy as np
import pytest

from refmesh_addon.core.capture.cleaning import cleaned
from refmesh_addon.core.capture.diagnosis import FrameStatistics, diagnose

from ..shapes import above, ball, box, flipped, inside_out, joined, moved, without


def frame(number: int, mesh=None, **changes) -> FrameStatistics:
    return FrameStatistics(**{"number": number, "content": str(number), **vars(cleaned(mesh or ball(2)).statistics), **changes})


def kinds(frames, gaps=()) -> list[tuple[str, str, int]]:
    return [(finding.kind, finding.severity, finding.frame) for finding in diagnose(frames, gaps)]


def take(odd=None, **changes) -> list[FrameStatistics]:
    """Nine frames of which the fifth is another mesh, or has other figures."""
    return [frame(number, odd if number == 5 else None, **(changes if number == 5 else {})) for number in range(1, 10)]


def test_sound_frames_have_no_findings():
    assert kinds(take()) == []


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
@pytest.mark.parametrize(
    "odd, expected",
    [
        (without(ball(2), above(ball(2), 0.5)), [("holes", "note", 5)]),
        (inside_out(ball(2)), [("facing", "note", 5)]),
        (flipped(ball(2), above(ball(2), 0.5)), [("facing", "note", 5)]),
        (moved(ball(2), scale=10.0), [("scale", "error", 5), ("volume", "warning", 5)]),
        (ball(3), [("vertex count", "warning", 5)]),
        (joined(ball(2), moved(ball(2), scale=0.9, shift=(0.1, 0, 0))), [("vertex count", "warning", 5), ("volume", "warning", 5)]),
    ],
    ids=["hole", "inside out", "flipped patch", "another unit", "finer mesh", "another body"],
)
def test_a_frame_that_stands_out_is_found_in_any_scale(odd, expected, scale):
    frames = [frame(number, moved(odd if number == 5 else ball(2), scale=scale)) for number in range(1, 10)]
    assert kinds(frames) == expected


def test_figures_that_are_no_matter_of_the_mesh():
    assert kinds(take(error="scan_5.obj: the file is empty")) == [("unreadable", "error", 5)]
    assert kinds(take(content="4")) == [("duplicate", "warning", 5)]
    assert kinds(take(missing_textures=("skin.png",))) == [("textures", "note", 5)]


def test_frames_that_stand_still_are_one_finding():
    frames = [frame(number, content=content) for number, content in enumerate("abbbcbdd", 1)]
    assert [(finding.frame, finding.message) for finding in diagnose(frames)] == [
        (3, "identical to frame 2, as is the next: motion stops here"),
        (6, "identical to frame 2: motion stops here"),
        (8, "identical to frame 7: motion stops here"),
    ]
    (finding,) = diagnose([frame(number, content="a") for number in range(1, 9)])
    assert finding.message == "identical to frame 1, as are the 6 after it: motion stops here"


def test_each_gap_is_one_finding_at_the_frame_that_is_held():
    frames = [frame(number) for number in (1, 2, 5, 6, 8)]
    findings = diagnose(frames, (3, 4, 7))
    assert [(finding.frame, finding.message.split(" missing")[0]) for finding in findings] == [(2, "frames 3 to 4 are"), (6, "frame 7 is")]


def test_what_most_frames_have_is_said_once_where_it_is_worst():
    frames = [frame(number, open_edges=10 + (number == 7)) for number in range(1, 10)]
    (finding,) = diagnose(frames)
    assert finding.frame == 7 and finding.message.startswith("11 open edges; ") and "in 9 of 9 frames" in finding.message


def test_one_thing_is_not_counted_in_the_plural():
    (finding,) = diagnose(take(missing_textures=("skin.png",)))
    assert finding.message == "1 missing texture: skin.png"


def test_steady_growth_and_noise_are_no_jumps():
    rng = np.random.default_rng(0)
    grown = [frame(number, vertices=int(1000 * 1.1**number), volume=1.1**number * rng.uniform(0.95, 1.05)) for number in range(40)]
    assert kinds(grown) == []
    restless = [frame(number, vertices=int(1000 * rng.uniform(0.5, 2.0))) for number in range(40)]
    assert kinds(restless) == []


def test_the_gravest_come_first():
    frames = take(error="unreadable")
    frames[1], frames[7] = frame(2, open_edges=3), frame(8, content="7")
    assert [severity for _, severity, _ in kinds(frames)] == ["error", "warning", "note"]


def test_short_and_empty_sequences_pass():
    assert kinds([]) == kinds([frame(1)]) == kinds([frame(1), frame(2, box())]) == []
