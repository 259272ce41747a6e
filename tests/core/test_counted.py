"""Numbers with their nouns."""

from __future__ import annotations

from refmesh_addon.core.counted import counted


def test_one_is_singular_and_everything_else_plural():
    assert [counted(count, "frame") for count in (0, 1, 2, 1200)] == ["0 frames", "1 frame", "2 frames", "1,200 frames"]
    assert [counted(count, "mesh", "meshes") for count in (1, 2)] == ["1 mesh", "2 meshes"]
