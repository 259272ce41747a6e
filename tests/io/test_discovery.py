"""Discovery by file names alone: the files of these tests are never opened, so most are empty."""

import re
import sys

import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.io.discovery import find_sequence
from refmesh_addon.io.sequence import timeline_frame

from .conftest import numbered


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
    root = folder("hand_1.obj", "hand_2.obj", "foot_7.obj", "foot_8.obj", "foot_9.obj", "nose_1.obj")
    with pytest.raises(RefMeshError, match=r"several sequences found \(foot_7.obj and 2 more; hand_1.obj and 1 more; nose_1.obj\)"):
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


def names(sequence):
    return [frame.path.name for frame in sequence.frames]


def test_any_file_of_a_level_of_detail_gives_that_level_and_a_note_of_the_others(folder):
    root = folder(*(f"scan_{number:04d}_lod{level}.obj" for number in range(4) for level in range(2)))
    for level in range(2):
        for number in range(4):
            sequence = find_sequence(root / f"scan_{number:04d}_lod{level}.obj")
            assert names(sequence) == [f"scan_{at:04d}_lod{level}.obj" for at in range(4)]
            assert sequence.name == "scan"
            assert any(f"left out: scan_0000_lod{1 - level}.obj and 3 more" in note for note in sequence.notes)
    with pytest.raises(RefMeshError, match="several sequences found"):
        find_sequence(root)


@pytest.mark.parametrize(("frames", "levels"), [(2, 2), (2, 3), (3, 2), (12, 3)])
@pytest.mark.parametrize("template", ["lod{1}_{0:03d}.obj", "scan_{0}_lod{1}.obj", "cam{1}_frame{0}.ply", "{0:04d}_take{1}.stl"])
def test_few_frames_of_many_levels_are_told_apart_by_their_words(folder, template, frames, levels):
    root = folder(*(template.format(number, level) for number in range(frames) for level in range(levels)))
    sequence = find_sequence(root / template.format(0, 1))
    assert names(sequence) == [template.format(number, 1) for number in range(frames)]


@pytest.mark.parametrize("template", ["frame_{0:03d}_{1}.obj", "{1}_{0}.obj", "cap.{0:04d}.{1}.ply"])
@pytest.mark.parametrize("stamp", [lambda at: 1_700_000_000_000 + 33 * at, lambda at: 1_700_000_000 + at // 30, lambda at: 40 * at])
def test_frame_and_time_stamp_are_one_take_in_the_order_of_frames(folder, template, stamp):
    root = folder(*(template.format(at, stamp(at)) for at in range(64)))
    for picked in (root, root / template.format(5, stamp(5))):
        assert find_sequence(picked).numbers == tuple(range(64))
        assert names(find_sequence(picked))[7] == template.format(7, stamp(7))


def test_several_cameras_with_time_stamps_stay_apart(folder):
    template = "cam{}_{:04d}_{}.obj"
    root = folder(*(template.format(camera, at, 1_700_000_000 + 33 * at + camera) for at in range(20) for camera in range(2)))
    sequence = find_sequence(root / template.format(1, 3, 1_700_000_100))
    assert names(sequence) == [template.format(1, at, 1_700_000_001 + 33 * at) for at in range(20)]


def test_every_other_reading_is_a_pattern_that_can_be_given(folder):
    root = folder(*(f"scan_{number:04d}_lod{level}.obj" for number in range(4) for level in range(2)))
    sequence = find_sequence(root / "scan_0002_lod1.obj")
    first, second = sequence.readings
    assert names(find_sequence(first)) == names(sequence)
    assert find_sequence(first).numbers == sequence.numbers
    assert names(find_sequence(second)) == ["scan_0002_lod0.obj", "scan_0002_lod1.obj"]
    assert any("for another reading give 'scan_0002_lod#.obj'" in note for note in sequence.notes)
    stamps = find_sequence(str(folder(*(f"s/f{at}_{at * 1000}.obj" for at in range(5))) / "s" / "f*_#.obj"))
    assert stamps.numbers == (0, 1000, 2000, 3000, 4000)


def test_a_take_that_changes_its_format_is_whole(folder):
    files = [*numbered("f_{:03d}.obj", range(3)), *numbered("f_{:03d}.ply", range(3, 7))]
    root = folder(*files)
    for picked in (root, root / "f_001.obj", root / "f_005.ply"):
        sequence = find_sequence(picked)
        assert names(sequence) == files
        assert sequence.notes == ("frames of several formats: 0-2 are .obj files, 3-6 are .ply files",)


def test_the_same_frames_in_another_format_are_left_out_with_a_note(folder):
    root = folder(*numbered("f_{}.obj", range(3)), *numbered("f_{}.ply", range(4)))
    assert names(find_sequence(root / "f_1.obj")) == numbered("f_{}.obj", range(3))
    assert find_sequence(root / "f_1.obj").notes == ("left out: f_0.ply and 3 more, which show the same frames as the .obj files",)
    assert names(find_sequence(root)) == numbered("f_{}.ply", range(4))
    assert "left out: f_0.obj and 2 more" in find_sequence(root).notes[0]


def test_what_a_folder_holds_besides_is_said(folder):
    root = folder("s1.obj", "s2.obj", "template.obj", "bust_1.ply")
    assert find_sequence(root).notes == ("left out: template.obj, without a number", "left out: bust_1.ply, of another name and format")


@pytest.mark.parametrize(
    "template", ["{:04d}/mesh.obj", "frame_{:03d}/scan.ply", "frame_{0}/scan_{0:04d}.obj", "{}/obj/mesh.obj", "take 2/fr{}/m.stl"]
)
def test_a_folder_per_frame(folder, template):
    root = folder(*(f"cap/{template.format(at)}" for at in range(3, 7)), "cap/notes/readme.txt") / "cap"
    base = root / "take 2" if template.startswith("take") else root
    deep = "/obj/" in template  # of a folder two levels above, a file says too little
    for picked in (base, base if deep else root / template.format(4), str(root / re.sub("{.*?}", "#", template))):
        sequence = find_sequence(picked)
        assert sequence.numbers == (3, 4, 5, 6)
        assert [frame.path for frame in sequence.frames] == [root / template.format(at) for at in range(3, 7)]
        assert sequence.folder == base
        assert sequence.name in ("cap", "frame", "fr", "scan")


def test_levels_of_detail_in_a_folder_per_frame(folder):
    root = folder(*(f"{at:03d}/lod{level}.obj" for at in range(3) for level in range(2)))
    sequence = find_sequence(root / "001" / "lod1.obj")
    assert [frame.path.relative_to(root).as_posix() for frame in sequence.frames] == [f"{at:03d}/lod1.obj" for at in range(3)]


@pytest.mark.parametrize("template", ["f_{}.obj", "walk.{:04d}.ply", "{:03d}.obj"])
def test_numbers_below_zero(folder, template):
    root = folder(*numbered(template, range(-3, 3)))
    for picked in (root, root / template.format(-2), root / template.format(1)):
        assert find_sequence(picked).numbers == (-3, -2, -1, 0, 1, 2)
    assert find_sequence(root, "-2-1").numbers == (-2, -1, 0, 1)
    assert find_sequence(root, "-3--2, 2").numbers == (-3, -2, 2)
    assert [timeline_frame(find_sequence(root), number) for number in range(-3, 3)] == [1, 2, 3, 4, 5, 6]


def test_a_dash_before_a_number_is_a_separator_behind_letters_and_digits(folder):
    assert find_sequence(folder(*numbered("one/scan-{:03d}.obj", range(1, 4))) / "one").numbers == (1, 2, 3)
    assert find_sequence(folder(*numbered("two/2024-01-{:02d}.obj", range(1, 4))) / "two").numbers == (1, 2, 3)


def test_reported_folders_are_found(shared_data):
    root = shared_data("reports")
    lod = find_sequence(root / "lod_pair" / "scan_0000_lod0.obj")
    assert lod.numbers == (0, 1, 2, 3)
    assert any("lod1" in note for note in lod.notes)
    assert find_sequence(root / "mixed_formats").numbers == tuple(range(7))


def test_real_sequences_are_found(shared_data):
    dancer = find_sequence(shared_data("dancer") / "dancer_fr0008.obj")
    assert (dancer.numbers, dancer.gaps) == (tuple(range(5, 15)), ())
    assert find_sequence(shared_data("collision"), "16-20").numbers == (16, 17, 18, 19, 20)


@pytest.mark.skipif(sys.platform != "linux", reason="other systems take no such names")
def test_a_name_that_is_no_unicode_is_refused_in_words(folder):
    with pytest.raises(RefMeshError, match=r"a\\udcff_1.obj: its name is not valid Unicode; rename it"):
        find_sequence(folder("a\udcff_1.obj", "a\udcff_2.obj"))


@pytest.mark.parametrize("source", ["a" * 5000, "a" * 300 + "/*.obj", "a\0b", "a\0*.obj", "*" * 300])
def test_sources_that_no_system_takes_are_refused_in_words(tmp_path, source):
    with pytest.raises(RefMeshError):
        find_sequence(tmp_path / source if "\0" not in source else f"{tmp_path}/{source}")
