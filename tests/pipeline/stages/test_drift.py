"""Drift removed by color, on a painted ball whose mesh turns against its surface from frame to frame."""

import shutil
from pathlib import Path

import pytest

from refmesh_addon.core.settings import Settings
from refmesh_addon.pipeline.run import run
from refmesh_addon.pipeline.session.job import JobSpec
from refmesh_addon.pipeline.session.parallel import Workers

from ..colored_takes import write_textured
from ..conftest import TINY
from ..running import cache_entries, finish, remade, report, results

SMALL = {"group_size": 2, "triangles": 600, "texture": "off", "until": "deformation", "frames": "3-4"}


@pytest.fixture(scope="module")
def take(tmp_path_factory):
    return write_textured(tmp_path_factory.mktemp("take"))


@pytest.fixture(scope="module")
def removed(take, tmp_path_factory):
    """The folder of a run with the drift removed, and the cache entries and results of the run without, which was there before."""
    output = tmp_path_factory.mktemp("removed")
    finish(take, output, **SMALL)
    before = cache_entries(output), results(output)
    assert finish(take, output, color_drift="on", **SMALL) == []
    return output, *before


def test_the_report_says_how_far_vertices_moved_and_what_it_cost(removed):
    for drift in (frame["drift"] for frame in report(removed[0])["frames"]):
        assert 0 <= drift["agreeing"] <= 1 and drift["distance_after"] <= 1.05 * drift["distance_before"]
        assert (drift["slide"] > 0) == (drift["agreeing"] > 0)


def test_it_goes_on_from_what_is_fitted(removed):
    output, before, _ = removed
    made = remade(before, cache_entries(output))
    assert any("undrifted_" in name for name in made)
    assert not any(name.startswith(("tracking", "reference", "deformation/frame", "deformation/handover")) for name in made)


def test_what_is_lost_comes_back_in_one_process_with_the_same_bytes(take, removed, tmp_path):
    output = Path(shutil.copytree(removed[0], tmp_path / "copy"))
    lost = [path for path in (output / "cache").rglob("*.npz") if path.name.startswith(("undrifted_", "smoothed_"))]
    assert lost
    for path in lost:
        path.unlink()
    job = {name: SMALL[name] for name in ("until", "frames")}
    flat = {name: value for name, value in SMALL.items() if name not in job}
    settings = Settings.from_flat({**TINY.to_flat(), **flat, "color_drift": "on"})
    with Workers(1) as workers:
        run(JobSpec(str(take), str(output), settings=settings, **job), lambda *progress: None, lambda line: None, workers)
    assert results(output) == results(removed[0])


def test_switched_off_frames_are_as_without_it(take, removed, tmp_path):
    output = Path(shutil.copytree(removed[0], tmp_path / "copy"))
    finish(take, output, **SMALL)
    assert results(output) == removed[2]


def test_frames_without_color_stay_as_they_are(take, tmp_path):
    plain = tmp_path / "plain"
    plain.mkdir()
    for path in take.glob("*.obj"):
        lines = [line for line in path.read_text().splitlines() if not line.startswith(("mtllib", "usemtl"))]
        (plain / path.name).write_text("\n".join(lines) + "\n")
    output = tmp_path / "out"
    finish(plain, output, color_drift="on", **SMALL)
    on = results(output)
    assert "drift" not in report(output)["frames"][0]
    finish(plain, output, color_drift="off", **SMALL)
    frames = [name for name in on if name.startswith("deformed/")]
    assert frames and all(results(output)[name] == on[name] for name in frames)
