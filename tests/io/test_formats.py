"""The table of the formats that frames are read from."""

from __future__ import annotations

from pathlib import Path

import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.io.formats import FRAME_FORMATS, STL, frame_format


@pytest.mark.parametrize("extension", FRAME_FORMATS)
def test_a_format_is_known_by_each_of_its_extensions_in_any_case(extension):
    assert extension.startswith(".") and extension.islower()
    assert frame_format(Path(f"a/b.c{extension.upper()}")) is FRAME_FORMATS[extension]
    assert FRAME_FORMATS[extension].parse


def test_names_are_unique():
    names = [known.name for known in set(FRAME_FORMATS.values())]
    assert len(set(names)) == len(names)


def test_stl_alone_shares_no_vertices():
    assert [known for known in FRAME_FORMATS.values() if not known.shared_vertices] == [STL]


@pytest.mark.parametrize("name", ["a", "obj", "a.fbx", "a.obj.gz"])
def test_a_file_of_another_format_is_refused(name):
    with pytest.raises(RefMeshError, match=f"{name}: .* give one of .obj, .ply, .stl, .glb, .off"):
        frame_format(Path(name))
