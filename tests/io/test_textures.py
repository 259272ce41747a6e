"""Textures that an OBJ names: found beside it, or named as missing."""

from pathlib import Path

import pytest

from refmesh_addon.io.textures import missing_textures


@pytest.fixture
def scan(tmp_path) -> Path:
    (tmp_path / "skins").mkdir()
    for name in ("skins/my skin.png", "bump.png"):
        (tmp_path / name).write_bytes(b"png")
    (tmp_path / "scan.mtl").write_bytes(b"newmtl a\r\nmap_Kd skins\\my skin.png\r\nmap_Bump -bm 0.5 bump.png\r\n")
    return tmp_path / "scan.obj"


def test_what_is_there_is_not_missing(scan):
    assert missing_textures(b"mtllib scan.mtl\nv 0 0 0\n", scan) == ()


def test_missing_texture_and_library_are_named_once(scan):
    (scan.parent / "scan.mtl").write_text("map_Kd gone.png\nmap_Ka gone.png\nmap_Kd bump.png\n")
    assert missing_textures(b"mtllib scan.mtl\nmtllib other file.mtl\n", scan) == ("gone.png", "other file.mtl")


def test_files_without_materials_miss_nothing(scan):
    assert missing_textures(b"v 0 0 0\n# mtllib none.mtl\n", scan) == ()
    assert missing_textures(b"mtllib none.mtl", scan.with_suffix(".ply")) == ()
