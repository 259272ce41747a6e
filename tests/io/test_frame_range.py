import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.io.frame_range import FrameRange, format_frames, format_others, format_ranges, format_selection, parse_ranges


def test_ranges_are_read_as_written():
    assert parse_ranges("6-10, 14,0003") == (FrameRange(6, 10), FrameRange(14, 14), FrameRange(3, 3))
    assert parse_ranges("  ") == ()


def test_a_range_holds_both_ends():
    assert [number for number in range(5, 12) if number in FrameRange(6, 10)] == [6, 7, 8, 9, 10]


@pytest.mark.parametrize("text", ["6-", "--6", "a", "6..10", "6-10-12", "1,,2", "6:10", "1.5", "٣"])
def test_what_is_no_range_is_refused_and_quoted(text):
    with pytest.raises(RefMeshError, match="--frames") as caught:
        parse_ranges(text)
    assert text in str(caught.value)


def test_a_falling_range_is_refused_with_the_right_one():
    with pytest.raises(RefMeshError, match="write 6-10"):
        parse_ranges("10-6")


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ([], ""),
        ([4], "4"),
        ([7, 5, 6, 9], "5-7, 9"),
        ([1, 3, 9], "1, 3, 9"),
        (range(0, 40, 2), "0-38 in steps of 2"),
        ([1003, 1010, 1017, 1031, 1038], "1003-1017, 1031-1038 in steps of 7"),
        ([0, 1, *range(3, 40, 3)], "0-1, 3, 6, 9, 12, ..., 39"),
    ],
)
def test_numbers_as_ranges(numbers, message):
    assert format_ranges(numbers) == message


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ([30], "frame 30"),
        ([10, 20, 50], "frames 10-20, 50"),
        ([10, 20, 30], "frames 10-30"),
        (range(20, 160, 20), "7 of 20 frames, between 20 and 140"),
    ],
)
def test_frames_of_a_take_are_named_as_a_person_would(numbers, message):
    """Ranges go on over numbers that the take does not have."""
    assert format_frames(numbers, range(0, 200, 10)) == message


def test_a_message_about_the_worst_frame_sums_up_the_others():
    assert format_others([7, 5, 6], range(10), "above 2%") == " (above 2% in 3 of 10 frames: 5-7)"
    assert format_others([7], range(10), "above 2%") == ""


def test_words_read_back_give_the_numbers():
    numbers = [1, 2, 3, 7, 9, 10]
    ranges = parse_ranges(format_ranges(numbers))
    assert [number for number in range(20) if any(number in item for item in ranges)] == numbers


def test_a_choice_among_numbers_comes_back_as_text():
    everything = [6, 7, 8, 10, 11, 20]
    for chosen, text in (([6, 7, 8, 10], "6-10"), ([7, 11, 20], "7,11-20"), ([], ""), (everything, "6-20")):
        assert format_selection(chosen, everything) == text
        ranges = parse_ranges(text)
        assert [number for number in everything if any(number in item for item in ranges)] == chosen
