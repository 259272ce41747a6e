import pytest
import trimesh

from refmesh_addon.io.truncation import check_off

TEXT = trimesh.creation.icosphere(subdivisions=1).export(file_type="off").encode()


def test_whole_files_pass_and_no_shorter_one_does():
    check_off(TEXT)
    for length in range(1, TEXT.rstrip().rindex(b" "), 37):
        with pytest.raises(ValueError):
            check_off(TEXT[:length])


def test_comments_and_blank_lines_in_off_do_not_count():
    lines = TEXT.splitlines()
    head, body = lines[:2], lines[2:]
    spaced = b"\n".join([b"# made by hand", *head, b"", *(line + b"  # row" for line in body), b""])
    check_off(spaced)
    with pytest.raises(ValueError, match="truncated"):
        check_off(b"\n".join([*head, b"# row", b"# row", b"# row", *body[:-2]]))
