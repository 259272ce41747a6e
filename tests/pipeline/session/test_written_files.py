"""Files in the output folder that RefMesh did not write are neither removed nor replaced."""

import os
import shutil

import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.io.files import WRITTEN_LIST
from refmesh_addon.pipeline.session.written_files import WrittenFiles

from ..running import finish, results

FOREIGN = ("film.mkv.partial", "deformed/frame_9999.ply", "reference/group_old.ply", "playback/group_mine.pc2", "texture/mine.png")


def test_what_others_put_between_the_results_stays(output, two_balls):
    for name in FOREIGN:
        (output / name).parent.mkdir(exist_ok=True)
        (output / name).write_text("mine")
    finish(two_balls, output, frames="3-4")
    assert [(output / name).read_text() for name in FOREIGN] == ["mine"] * len(FOREIGN)
    assert not (output / "deformed" / "frame_0005.ply").exists(), "a result of the earlier run goes"


@pytest.mark.parametrize("name", ["report.json", "centers.npz", "reference/group_000.ply", "deformed/frame_0004.ply"])
def test_a_file_of_the_user_is_not_replaced(two_balls, tmp_path, name):
    (tmp_path / name).parent.mkdir(exist_ok=True)
    (tmp_path / name).write_text("mine")
    with pytest.raises(RefMeshError, match=rf"{name}: is not a file that RefMesh wrote"):
        finish(two_balls, tmp_path)
    assert (tmp_path / name).read_text() == "mine"


def test_a_folder_without_its_list_is_written_to_as_before(output, finished, two_balls):
    shutil.rmtree(output / "cache")
    (output / "deformed" / "frame_9999.ply").write_text("mine")
    finish(two_balls, output)
    assert (output / "deformed" / "frame_9999.ply").read_text() == "mine"
    (output / "deformed" / "frame_9999.ply").unlink()
    assert results(output) == results(finished)


def test_names_are_listed_before_their_files_are_written(tmp_path):
    path = WrittenFiles(tmp_path).claim("deformed/frame_0001.ply")
    path.parent.mkdir()
    path.touch()
    assert WrittenFiles(tmp_path).claim("deformed/frame_0001.ply") == path, "as a run that is killed here would leave it"


def test_a_removed_name_is_free_for_others(tmp_path):
    files = WrittenFiles(tmp_path)
    files.claim("a.ply").touch()
    files.remove_stale("*.ply", keep=[])
    (tmp_path / "a.ply").write_text("mine")
    for one in (files, WrittenFiles(tmp_path)):
        one.remove_stale("*.ply", keep=[])
        with pytest.raises(RefMeshError, match=r"a\.ply"):
            one.claim("a.ply")


@pytest.mark.skipif(os.name != "posix", reason="links need rights of their own on Windows")
def test_a_link_in_place_of_the_list_is_replaced_not_followed(tmp_path):
    (tmp_path / "thesis").write_text("years of work")
    (tmp_path / "out" / "cache").mkdir(parents=True)
    os.symlink(tmp_path / "thesis", tmp_path / "out" / WRITTEN_LIST)
    WrittenFiles(tmp_path / "out").claim("a.ply")
    assert (tmp_path / "thesis").read_text() == "years of work"
