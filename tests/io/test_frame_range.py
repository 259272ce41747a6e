import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.io.frame_range import FrameRange, format_ranges, format_selection, parse_ranges


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
    ("numbers", "message"), [([], ""), ([4], "4"), ([7, 5, 6, 9], "5-7, 9"), (range(0, 40, 2), "0, 2, 4, 6, 8, ..., 38")]
)
def test_numbers_as_ranges(numbers, message):
    assert format_ranges(numbers) == message


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
