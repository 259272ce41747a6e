"""Messages on as many lines as they need."""

from __future__ import annotations

import blf
import pytest

from refmesh_addon.properties.wording import wrapped

MESSAGE = "RefMesh needs packages that this Blender does not have: WWWWW, iiiii. To get them: 'sudo apt install python3-tqdm'."


@pytest.mark.parametrize("width", [100.0, 150.0, 400.0])
def test_lines_fit_the_width_and_keep_every_word(width):
    lines = wrapped(f"{MESSAGE}\n {MESSAGE}", width)
    assert " ".join(lines).split() == 2 * MESSAGE.split()
    assert all(blf.dimensions(0, line)[0] <= width for line in lines)
    pairs = zip(lines, lines[1:])
    assert all(blf.dimensions(0, f"{line} {after.split()[0]}")[0] > width for line, after in pairs), "a line ends too soon"


def test_a_word_wider_than_a_line_is_broken():
    path = "/a" * 100
    lines = wrapped(f"{path} is missing", 100.0)
    assert "".join(lines) == f"{path}is missing"
    assert all(blf.dimensions(0, line)[0] <= 100.0 for line in lines)
    assert wrapped("", 100.0) == []
