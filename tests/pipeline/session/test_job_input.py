"""An output folder that holds the input is refused, whatever its frames and folders are called."""

import os

import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.settings import Settings
from refmesh_addon.io.sequence import BAKED_FOLDER
from refmesh_addon.pipeline.session.job import JobSpec
from refmesh_addon.pipeline.session.job_input import job_sequence


def frames_in(folder, name="scan_{}.obj"):
    folder.mkdir(parents=True, exist_ok=True)
    for number in (1, 2, 3):
        (folder / name.format(number)).touch()
    return folder


def refused(source, output):
    with pytest.raises(RefMeshError, match="the output folder holds the input"):
        job_sequence(JobSpec(str(source), str(output)))


@pytest.mark.parametrize("folder", [".", "deformed", "reference", "anything", "cache/frames"])
def test_frames_inside_the_output_are_refused(tmp_path, folder):
    refused(frames_in(tmp_path / "out" / folder), tmp_path / "out")


def test_frames_that_are_linked_into_the_output_are_refused(tmp_path):
    frames = frames_in(tmp_path / "frames", "frame_{}.ply")
    (tmp_path / "out").mkdir()
    os.symlink(frames, tmp_path / "out" / "deformed")
    refused(frames, tmp_path / "out")
    refused(tmp_path / "out" / "deformed", tmp_path / "out")


def test_links_to_frames_in_the_output_are_refused(tmp_path):
    frames, links = frames_in(tmp_path / "out"), tmp_path / "links"
    links.mkdir()
    for frame in frames.iterdir():
        os.symlink(frame, links / frame.name)
    refused(links, tmp_path / "out")


def test_another_name_of_the_output_folder_is_the_same_folder(tmp_path):
    frames = frames_in(tmp_path / "take")
    os.symlink(frames, tmp_path / "alias")
    refused(frames, tmp_path / "alias")
    refused(tmp_path / "alias", frames)


def test_an_output_beside_or_below_the_input_is_taken(tmp_path):
    frames = frames_in(tmp_path / "take")
    for output in (frames / "refmesh_scan", tmp_path / "take2"):
        output.mkdir()
        assert job_sequence(JobSpec(str(frames), str(output))).numbers == (1, 2, 3)


def test_frames_that_refmesh_baked_into_the_output_are_taken(tmp_path):
    frames = frames_in(tmp_path / "out" / BAKED_FOLDER)
    assert job_sequence(JobSpec(str(frames), str(tmp_path / "out"))).numbers == (1, 2, 3)


@pytest.mark.parametrize("folder, taken", [("out/reference", False), ("out/deformed", False), ("out", True), ("mine", True)])
def test_a_mesh_of_the_users_among_the_results_is_refused(tmp_path, folder, taken):
    mesh = tmp_path / folder / "group_000.ply"
    mesh.parent.mkdir(parents=True)
    mesh.touch()
    spec = JobSpec(str(frames_in(tmp_path / "take")), str(tmp_path / "out"), settings=Settings.from_flat({"mesh": str(mesh)}))
    if taken:
        assert job_sequence(spec).numbers == (1, 2, 3)
    else:
        with pytest.raises(RefMeshError, match=r"group_000\.ply: lies among the results"):
            job_sequence(spec)
