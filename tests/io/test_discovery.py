"""Discovery by file names alone: the files of these tests are never opened, so most are empty."""

import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.io.discovery import find_sequence
from refmesh_addon.io.sequence import timeline_frame


@pytest.fixture
def folder(tmp_path):
    def make(*names):
        for name in names:
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).touch()
        return tmp_path

    return make


def numbered(pattern, numbers):
    return [pattern.format(number) for number in numbers]


@pytest.mark.parametrize(
    "pattern", ["scan_{}.obj", "scan_{:04d}.obj", "{:06d}.ply", "{}.stl", "a-{:03d}_low.glb", "x.{:02d}.OFF", "take 2 fr{}.obj"]
)
def test_prefix_suffix_padding_and_extension_do_not_matter(folder, pattern):
    numbers = [98, 99, 100, 101]
    root = folder(*numbered(pattern, reversed(numbers)))
    sequence = find_sequence(root)
    assert sequence.numbers == tuple(numbers)
    assert [frame.path.name for frame in sequence.frames] == numbered(pattern, numbers)
    assert sequence.gaps == ()


def test_folder_any_file_and_pattern_find_the_same(folder):
    root = folder(*numbered("scan_{:04d}.obj", range(8, 12)))
    expected = find_sequence(root)
    assert find_sequence(str(root / "scan_*.obj")) == expected
    for frame in expected.frames:
        assert find_sequence(frame.path) == expected


def test_folder_takes_the_most_frequent_extension(folder):
    root = folder("a1.obj", "a1.mtl", "a1.png", "a2.mtl", "a3.mtl", *numbered("b{}.ply", range(3)))
    assert [frame.path.name for frame in find_sequence(root).frames] == ["b0.ply", "b1.ply", "b2.ply"]


def test_what_is_no_frame_is_passed_over(folder):
    root = folder("s1.obj", "s2.obj", "._s1.obj", "._s2.obj", "template.obj", "s1.obj.partial")
    assert [frame.path.name for frame in find_sequence(root).frames] == ["s1.obj", "s2.obj"]


def test_digits_that_all_names_share_are_not_the_number(folder):
    root = folder("take3_0001_lod2.obj", "take3_0002_lod2.obj")
    assert find_sequence(root).numbers == (1, 2)
    assert find_sequence(root / "take3_0002_lod2.obj").numbers == (1, 2)


def test_a_file_stands_for_its_own_sequence_among_several(folder):
    root = folder("hand_1.obj", "hand_2.obj", "foot_7.obj", "foot_8.obj", "foot_9.obj")
    with pytest.raises(RefMeshError, match=r"several sequences found \(foot_7.obj and 2 more; hand_1.obj and 1 more\)"):
        find_sequence(root)
    assert find_sequence(root / "hand_2.obj").numbers == (1, 2)
    assert find_sequence(str(root / "foot_*")).numbers == (7, 8, 9)


def test_a_lone_file_is_a_sequence_of_one_frame(folder):
    root = folder("bust.obj", "one/scan_0042.ply")
    assert find_sequence(root).numbers == (1,)
    assert find_sequence(root / "bust.obj").numbers == (1,)
    assert find_sequence(root / "one" / "scan_0042.ply").numbers == (42,)


def test_name_is_the_prefix_or_the_folder(folder):
    assert find_sequence(folder("walk_cycle_001.obj", "walk_cycle_002.obj") / "walk_cycle_001.obj").name == "walk_cycle"
    assert find_sequence(folder("jump/001.obj", "jump/002.obj") / "jump").name == "jump"


def test_gaps_are_found_and_even_steps_are_none(folder):
    root = folder(*numbered("one/a{}.obj", [5, 6, 8, 11]), *numbered("ten/a{}.obj", [10, 20, 30, 50]))
    assert find_sequence(root / "one").gaps == (7, 9, 10)
    ten = find_sequence(root / "ten")
    assert (ten.step, ten.gaps) == (10, (40,))


def test_time_stamps_have_no_gaps_and_one_scene_frame_each(folder):
    stamps = [1_700_000_000_000 + 1000 * frame // 30 for frame in range(12)]
    sequence = find_sequence(folder(*numbered("{}.obj", stamps)))
    assert sequence.gaps == ()
    assert [timeline_frame(sequence, stamp) for stamp in stamps] == list(range(1, 13))


def test_frames_are_chosen_by_number_ends_included(folder):
    root = folder(*numbered("a{}.obj", [5, 6, 8, 9, 10, 14, 16]))
    sequence = find_sequence(root, "6-10, 14")
    assert sequence.numbers == (6, 8, 9, 10, 14)
    assert sequence.gaps == (7,), "13 and 15 were not asked for"
    assert find_sequence(root, "14,6-8,6").numbers == (6, 8, 14)


@pytest.mark.parametrize(
    ("names", "source", "message"),
    [
        ([], "", "no meshes found"),
        (["readme.txt"], "", "no meshes found"),
        ([], "nowhere", "no such file or folder"),
        ([], "scan_*.obj", "no meshes found"),
        (["scan_1.abc"], "scan_1.abc", "'.abc' is not a mesh format"),
        (["left.obj", "right.obj"], "", "carry no frame number"),
        (["f1.obj", "f01.obj"], "", "f01.obj and f1.obj are both frame 1"),
        (["f" + "9" * 30 + ".obj"], "", "more than 18 digits"),
    ],
)
def test_what_is_no_sequence_is_refused_by_name(folder, names, source, message):
    path = folder(*names) / source
    with pytest.raises(RefMeshError, match=message) as caught:
        find_sequence(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("choice", ["4-8", "6-11", "7", "6,99"])
def test_numbers_that_are_not_there_are_refused(folder, choice):
    root = folder(*numbered("a{}.obj", [5, 6, 8, 9, 10]))
    with pytest.raises(RefMeshError, match=r"--frames names frame \d+, which is missing: 'a' has 5-6, 8-10"):
        find_sequence(root, choice)


def test_real_sequences_are_found(shared_data):
    dancer = find_sequence(shared_data("dancer") / "dancer_fr0008.obj")
    assert (dancer.numbers, dancer.gaps) == (tuple(range(5, 15)), ())
    assert find_sequence(shared_data("collision"), "16-20").numbers == (16, 17, 18, 19, 20)
