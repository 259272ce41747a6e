"""Jobs that run elsewhere, and the cache that they leave."""

import json
from types import SimpleNamespace

import bpy
import pytest

from refmesh_addon.properties import preferences


def test_the_panel_writes_a_job_with_its_settings(ball, tmp_path):
    settings = ball.refmesh.settings
    settings.centers, ball.refmesh.output = 123, str(tmp_path / "out")
    assert bpy.ops.refmesh.export_job(directory=str(tmp_path / "job"), scheduler="tcp://host:1") == {"FINISHED"}
    job = json.loads((tmp_path / "job" / "job.json").read_text())
    assert (job["settings"]["centers"], job["output"], job["scheduler"]) == (123, str(tmp_path / "out"), "")
    steps = json.loads((tmp_path / "job" / "template.json").read_text())["steps"]
    assert steps[-1]["name"] == "Write Results", "scripts alone add the scene"
    assert not (tmp_path / "out").exists()


def test_a_job_without_a_folder_is_refused(ball):
    with pytest.raises(RuntimeError, match="no folder to write the job to"):
        bpy.ops.refmesh.export_job()


def test_clean_cache_removes_entries_and_nothing_else(solved, results):
    entry, own = results / "cache" / "tracking" / "frame_0006-0123456789ab.npz", results / "cache" / "notes.npz"
    entry.parent.mkdir(parents=True, exist_ok=True)
    for path in (entry, own):
        path.write_bytes(b"content")
    kept = {path for path in results.rglob("*") if path.is_file()} - {entry}
    solved.refmesh.output = str(results)
    assert bpy.ops.refmesh.clean_cache() == {"FINISHED"}
    assert not entry.exists() and kept <= {path for path in results.rglob("*") if path.is_file()}


def test_the_preferred_scheduler_is_for_windows_only(monkeypatch):
    """A script names its own; what an artist has set must not send its frames anywhere."""
    chosen = SimpleNamespace(preferences=SimpleNamespace(scheduler=" tcp://host:8786 "))
    context = SimpleNamespace(preferences=SimpleNamespace(addons={preferences.ADDON: chosen}))
    assert preferences.preferred_scheduler(context) == ""
    monkeypatch.setattr(preferences.bpy, "app", SimpleNamespace(background=False))
    assert preferences.preferred_scheduler(context) == "tcp://host:8786"
    assert preferences.preferred_scheduler(SimpleNamespace(preferences=SimpleNamespace(addons={}))) == ""
