"""Which scene frame shows which frame of a sequence."""


from refmesh_addon.io.discovery import find_sequence
from refmesh_addon.io.sequence import BLENDER_LAST_FRAME, held_frames, timeline_frame

from .conftest import numbered


def test_scene_frames_are_the_numbers_even_when_few_are_chosen(folder):
    root = folder(*numbered("a{}.obj", range(5, 15)))
    sequence = find_sequence(root, "6,14")
    assert [timeline_frame(sequence, number) for number in sequence.numbers] == [6, 14]


def test_scene_frames_advance_by_one_for_each_step(folder):
    sequence = find_sequence(folder(*numbered("a{}.obj", [10, 20, 30, 50])))
    assert [timeline_frame(sequence, number) for number in sequence.numbers] == [10, 11, 12, 14]
    assert held_frames(sequence) == (0, 1, 2, 2, 3), "a missing frame holds the one before"


def test_numbers_beyond_the_timeline_start_at_one(folder):
    first = BLENDER_LAST_FRAME - 1
    assert timeline_frame(find_sequence(folder(*numbered("in/a{}.obj", [first, first + 1])) / "in"), first) == first
    sequence = find_sequence(folder(*numbered("out/a{}.obj", [first, first + 1, first + 3])) / "out")
    assert [timeline_frame(sequence, number) for number in sequence.numbers] == [1, 2, 4]
