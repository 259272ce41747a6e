"""The record of textures names nothing but textures, whoever wrote it."""

import json

from refmesh_addon.pipeline.session.painted import record_texture, rename_painted

NAME = "texture/group_000_steady.png"


def test_a_texture_that_was_painted_on_is_renamed_and_one_that_was_not_stays(tmp_path):
    for folder in ("cache", "texture"):
        (tmp_path / folder).mkdir()
    record_texture(tmp_path, NAME, b"picture")
    (tmp_path / NAME).write_bytes(b"picture")
    assert rename_painted(tmp_path) == {}
    (tmp_path / NAME).write_bytes(b"painted")
    assert rename_painted(tmp_path) == {NAME: "texture/group_000_steady_painted_1.png"}


def test_a_record_from_elsewhere_renames_nothing_else(tmp_path):
    for folder in ("out/cache", "out/texture"):
        (tmp_path / folder).mkdir(parents=True)
    mine, results = tmp_path / "mine.png", tmp_path / "out" / "deformed.ply"
    for path in (mine, results):
        path.write_bytes(b"mine")
    names = ["../mine.png", str(mine), "deformed.ply", "texture/../../mine.png", "texture/group_000_steady.png/../../../mine.png"]
    for record in ({name: [] for name in names}, {NAME: 3}, [], "x"):
        (tmp_path / "out" / "cache" / "steady_textures.json").write_text(json.dumps(record))
        assert rename_painted(tmp_path / "out") == {}
    assert mine.exists() and results.exists()
