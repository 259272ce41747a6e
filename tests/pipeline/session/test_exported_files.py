"""What lies where an export is about to write: replaced where an export wrote it, renamed otherwise."""

import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.pipeline.session.exported_files import ExportedFiles


def export(results, path, content):
    """As a format does; returns the new names of what was in the way."""
    files = ExportedFiles(results)
    files.make_way(path)
    path.write_text(content)
    return [kept.name for kept in files.kept]


def test_files_of_others_are_renamed_and_those_of_exports_replaced(tmp_path):
    target = tmp_path / "assets" / "dancer.glb"
    target.parent.mkdir()
    target.write_text("mine")
    assert export(tmp_path / "out", target, "first") == ["dancer_kept_1.glb"]
    assert export(tmp_path / "out", target, "second") == []
    assert (target.read_text(), target.with_name("dancer_kept_1.glb").read_text()) == ("second", "mine")
    assert export(tmp_path / "other take", target, "third") == ["dancer_kept_2.glb"], "another take of the same name"
    assert target.with_name("dancer_kept_2.glb").read_text() == "second"


def test_the_export_folder_among_the_results_is_ours(tmp_path):
    target = tmp_path / "out" / "export" / "dancer.glb"
    target.parent.mkdir(parents=True)
    target.write_text("of a version without a record")
    assert export(tmp_path / "out", target, "now") == []


def test_folders_are_renamed_as_a_whole(tmp_path):
    folder = tmp_path / "dancer_vat"
    folder.mkdir()
    (folder / "notes.txt").write_text("mine")
    files = ExportedFiles(tmp_path / "out")
    files.make_way(folder)
    assert not folder.exists() and (tmp_path / "dancer_vat_kept_1" / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize("record", ["", "{}", "[1, null]", '["'])
def test_a_damaged_record_keeps_files(tmp_path, record):
    (tmp_path / "out" / "cache").mkdir(parents=True)
    (tmp_path / "out" / "cache" / "exported.json").write_text(record)
    (tmp_path / "dancer.glb").write_text("mine")
    assert export(tmp_path / "out", tmp_path / "dancer.glb", "now") == ["dancer_kept_1.glb"]


def test_what_cannot_be_renamed_is_named(tmp_path, monkeypatch):
    (tmp_path / "dancer.glb").write_text("mine")
    files = ExportedFiles(tmp_path / "out")

    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(type(tmp_path), "rename", refuse)
    with pytest.raises(RefMeshError, match=r"dancer.glb: no export wrote it, and it cannot be renamed \(Permission denied\)"):
        files.make_way(tmp_path / "dancer.glb")
