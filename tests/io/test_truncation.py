import pytest
import trimesh

from refmesh_addon.io.truncation import check_off, check_ply, check_stl

CHECKS = {"ply": check_ply, "off": check_off, "stl": check_stl}
BALL = trimesh.creation.icosphere(subdivisions=1)
TEXT_FILES = {
    "ply": BALL.export(file_type="ply", encoding="ascii"),
    "off": BALL.export(file_type="off").encode(),
    "stl": BALL.export(file_type="stl_ascii").encode(),
}


@pytest.mark.parametrize("kind", TEXT_FILES)
def test_whole_files_pass_and_no_shorter_one_does(kind):
    data = TEXT_FILES[kind]
    CHECKS[kind](data)
    last_needed = len(data.rstrip()) - 1 if kind == "stl" else data.rstrip().rindex(b" ")
    for length in range(1, last_needed, 37):
        with pytest.raises(ValueError):
            CHECKS[kind](data[:length])


def test_binary_stl_is_as_long_as_its_head_says():
    data = BALL.export(file_type="stl")
    check_stl(data)
    for wrong in (data[:-1], data[:-50], data + b"\\0"):
        with pytest.raises(ValueError, match="length"):
            check_stl(wrong)


def test_comments_and_blank_lines_in_off_do_not_count():
    lines = TEXT_FILES["off"].splitlines()
    head, body = lines[:2], lines[2:]
    spaced = b"\n".join([b"# made by hand", *head, b"", *(line + b"  # row" for line in body), b""])
    check_off(spaced)
    with pytest.raises(ValueError, match="truncated"):
        check_off(b"\n".join([*head, b"# row", b"# row", b"# row", *body[:-2]]))
