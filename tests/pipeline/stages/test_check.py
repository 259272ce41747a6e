"""The check of a whole sequence on disk: what it writes, what it takes up again, and what it refuses."""

import os
from pathlib import Path

import pytest
import trimesh

from refmesh_addon.core.errors import Canceled, RefMeshError
from refmesh_addon.io.discovery import find_sequence
from refmesh_addon.io.findings import CHECK_TEXT, read_findings, read_kind
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.preview import PREVIEW_FOLDER, preview_path, read_preview
from refmesh_addon.pipeline.process.client import WorkerProcess
from refmesh_addon.pipeline.session.job import CHECK, JobSpec
from refmesh_addon.pipeline.session.parallel import Workers
from refmesh_addon.pipeline.stages.check import check_sequence

from ..running import cache_entries, finish, remade, stages_of


@pytest.fixture
def take(tmp_path) -> Path:
    """Six frames: 3 is missing, 5 is cut off, 7 is a copy of 6."""
    folder = tmp_path / "take"
    folder.mkdir()
    for number in (1, 2, 4, 5, 6, 7):
        ball = trimesh.creation.icosphere(2, radius=1 + 0.01 * min(number, 6))
        ball.export(folder / f"take_{number}.ply")
    data = (folder / "take_5.ply").read_bytes()
    (folder / "take_5.ply").write_bytes(data[: len(data) // 2])
    return folder


def check(take: Path, output: Path, notify=lambda *_: None, **job):
    with Workers(1) as workers:
        return check_sequence(JobSpec(str(take), str(output), until=CHECK, **job), find_sequence(take), notify, workers)


def test_findings_of_a_real_process_are_written_for_panel_and_person(take, tmp_path):
    *_, last = WorkerProcess(JobSpec(str(take), str(tmp_path / "out"), until=CHECK)).events()
    assert last.kind == "done", last.message
    findings = read_findings(tmp_path / "out")
    assert [(finding.kind, finding.frame) for finding in findings] == [("unreadable", 5), ("gap", 2), ("duplicate", 7)]
    text = (tmp_path / "out" / CHECK_TEXT).read_text()
    assert all(finding.message in text for finding in findings) and str(take) not in text


@pytest.mark.parametrize("lowest, kind", [(-2.0, "closed bodies (2 of 2 frames are closed)"), (0.0, "open surfaces, as one camera")])
def test_the_kind_of_capture_is_said_once(tmp_path, lowest, kind):
    folder = tmp_path / "scan"
    folder.mkdir()
    for number in (1, 2):
        sphere = trimesh.creation.icosphere(3, radius=1 + 0.01 * number)
        sphere.update_faces(sphere.triangles_center[:, 2] > lowest)
        sphere.export(folder / f"scan_{number}.ply")
    check(folder, tmp_path / "out")
    text = (tmp_path / "out" / CHECK_TEXT).read_text()
    assert text.count("the take shows ") == 1 and read_kind(tmp_path / "out") in text
    assert read_kind(tmp_path / "out").startswith(f"the take shows {kind}")


def test_files_that_were_left_out_are_notes(take, tmp_path):
    trimesh.creation.box().export(take / "props.ply")
    findings = check(take, tmp_path / "out")
    assert [finding.message for finding in findings if finding.kind == "names"] == ["left out: props.ply, without a number"]
    assert "left out: props.ply" in (tmp_path / "out" / CHECK_TEXT).read_text()


def test_notes_of_the_scene_are_in_the_text(take, tmp_path):
    findings = check(take, tmp_path / "out", notes=("18.7 m long",))
    assert [(finding.severity, finding.message) for finding in findings if finding.kind == "scene"] == [("note", "18.7 m long")]
    assert "  frame 1: 18.7 m long\n" in (tmp_path / "out" / CHECK_TEXT).read_text()


def test_frames_are_prepared_for_the_preview(take, tmp_path):
    check(take, tmp_path / "out")
    for number in (1, 2, 4, 6, 7):
        path = take / f"take_{number}.ply"
        assert len(read_preview(preview_path(tmp_path / "out", path)).vertices) == len(read_mesh(path).vertices)
    assert len(list((tmp_path / "out" / PREVIEW_FOLDER).iterdir())) == 5


def test_only_what_changed_is_looked_at_again(take, tmp_path, monkeypatch):
    before = check(take, tmp_path / "out")
    trimesh.creation.box().export(take / "take_5.ply")
    looked = []

    def remembered(_, function, tasks, poll):
        for index, task in enumerate(tasks):
            looked.append(task)
            yield index, function(*task)

    monkeypatch.setattr(Workers, "map", remembered)
    after = check(take, tmp_path / "out")
    assert [task[0].name for task in looked] == ["take_5.ply"]
    assert "unreadable" not in [finding.kind for finding in after] and before != after
    assert check(take, tmp_path / "out") == after and len(looked) == 1


def test_same_findings_however_often(take, tmp_path):
    assert check(take, tmp_path / "a") == check(take, tmp_path / "a") == check(take, tmp_path / "b")
    assert (tmp_path / "a" / CHECK_TEXT).read_bytes() == (tmp_path / "b" / CHECK_TEXT).read_bytes()


def test_a_wish_to_stop_is_heard_and_what_is_done_is_kept(take, tmp_path):
    def stop(stage, frame, share, *_):
        if share > 0.3:
            raise Canceled

    with pytest.raises(Canceled):
        check(take, tmp_path / "out", stop)
    assert list((tmp_path / "out" / PREVIEW_FOLDER).glob("*.npz")) and not (tmp_path / "out" / CHECK_TEXT).exists()


def test_a_job_after_the_check_parses_nothing_again(two_balls, tmp_path):
    check(two_balls, tmp_path / "out")
    before = cache_entries(tmp_path / "out")
    assert stages_of(set(before)) == {"frames"}
    finish(two_balls, tmp_path / "out", until="tracking")
    assert not any(name.startswith("frames/") for name in remade(before, cache_entries(tmp_path / "out")))


def test_a_check_after_a_job_parses_nothing_again_and_finds_the_preview(two_balls, tmp_path):
    finish(two_balls, tmp_path / "out", until="tracking")
    before = cache_entries(tmp_path / "out")
    assert check(two_balls, tmp_path / "out") == []
    assert cache_entries(tmp_path / "out") == before
    assert all(read_preview(preview_path(tmp_path / "out", path)) for path in two_balls.iterdir())


def test_a_texture_that_appears_is_no_longer_missing(tmp_path):
    (tmp_path / "in").mkdir()
    ball = trimesh.creation.icosphere(2).export(file_type="obj", include_normals=False)
    (tmp_path / "in" / "ball_1.obj").write_text("mtllib ball.mtl\n" + ball)
    assert [finding.kind for finding in check(tmp_path / "in", tmp_path / "out")] == ["textures"]
    (tmp_path / "in" / "ball.mtl").write_text("newmtl skin\n")
    assert check(tmp_path / "in", tmp_path / "out") == []


def test_findings_that_are_not_there_are_named(tmp_path):
    with pytest.raises(RefMeshError, match="sequence_check.json: cannot be read"):
        read_findings(tmp_path)


def test_a_broken_file_of_the_same_size_and_time_is_found(take, tmp_path):
    output, path = tmp_path / "out", take / "take_2.ply"
    assert [finding.frame for finding in check(take, output) if finding.kind == "unreadable"] == [5]
    before, shown = path.stat(), preview_path(output, path)
    path.write_bytes(b"ply" + bytes(before.st_size - 3))
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert path.stat().st_size == before.st_size
    assert [finding.frame for finding in check(take, output) if finding.kind == "unreadable"] == [2, 5]
    assert not shown.exists() and not preview_path(output, path).exists()


def test_a_damaged_cache_entry_is_computed_again_and_noted(take, tmp_path):
    before = check(take, tmp_path / "out")
    entry = next((tmp_path / "out" / "cache" / "frames").glob("frame_0002-*.npz"))
    data = bytearray(entry.read_bytes())
    data[len(data) // 2] ^= 1
    entry.unlink()  # the preview is a link to it
    entry.write_bytes(data)
    findings = check(take, tmp_path / "out")
    assert [finding for finding in findings if finding.kind != "cache"] == before
    assert [str(entry) in finding.message for finding in findings if finding.kind == "cache"] == [True]
    assert check(take, tmp_path / "out") == before
