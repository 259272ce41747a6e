"""Global optimization on disk: what it reports, what it hands on, and that a run goes on where it was killed."""

import numpy as np
import pytest

from refmesh_addon.io.pc2 import read_pc2

from ..conftest import FRAMES, TINY
from ..running import cache_entries, finish, remade, report, results


@pytest.fixture(scope="module")
def optimized(two_balls, tmp_path_factory):
    output = tmp_path_factory.mktemp("optimized")
    finish(two_balls, output, until="tracking", global_rounds=2)
    return output


class Killed(Exception):
    pass


def test_figures_of_all_rounds_are_reported(optimized):
    figures = report(optimized)["tracking"]
    for name in ("dfu", "dfu_forward", "lloyd_energy", "arap_energy"):
        assert len(figures[name]) == len(FRAMES)
    assert figures["centers_dropped"] == 0
    assert len(figures["global_energies"]) == 2
    for energies in figures["global_energies"]:
        assert (np.diff(energies) <= 0).all()
    assert figures["dfu"] != figures["dfu_forward"]


def test_the_optimized_centers_are_handed_on(optimized, two_balls, tmp_path):
    finish(two_balls, tmp_path, until="tracking")
    forward, found = (np.load(folder / "centers.npz")["positions"] for folder in (tmp_path, optimized))
    assert found.shape == (len(FRAMES), TINY.tracking.centers, 3)
    assert not np.allclose(found, forward, atol=1e-4)
    played = np.stack(list(read_pc2(optimized / report(optimized)["centers_playback"])))
    np.testing.assert_array_equal(played, found.astype(np.float32))
    assert "dfu_forward" not in report(tmp_path)["tracking"]


def test_the_reference_stage_takes_them(two_balls, tmp_path):
    finish(two_balls, tmp_path, until="reference", global_rounds=1)
    with np.load(tmp_path / "centers.npz") as centers:
        assert len(centers["group_000_reference_centers"]) == centers["positions"].shape[1]


def test_asking_for_rounds_later_tracks_nothing_again(optimized, two_balls, tmp_path):
    finish(two_balls, tmp_path, until="tracking")
    before = cache_entries(tmp_path)
    finish(two_balls, tmp_path, until="tracking", global_rounds=2)
    made = remade(before, cache_entries(tmp_path))
    assert {"tracking/global_00", "tracking/global_01"} <= made
    assert not any(name.startswith(("tracking/frame", "tracking/state", "frames/")) for name in made)
    assert results(tmp_path) == results(optimized)


def test_a_run_killed_between_rounds_goes_on_with_the_next(optimized, two_balls, tmp_path):
    def killer(stage, frame, share, *_):
        if "tracking/global_00" in (cache_entries(tmp_path) if (tmp_path / "cache").exists() else {}):
            raise Killed

    with pytest.raises(Killed):
        finish(two_balls, tmp_path, killer, until="tracking", global_rounds=2)
    before = cache_entries(tmp_path)
    assert "tracking/global_01" not in before
    finish(two_balls, tmp_path, until="tracking", global_rounds=2)
    assert "tracking/global_00" not in remade(before, cache_entries(tmp_path))
    assert results(tmp_path) == results(optimized)


def test_progress_never_goes_back(two_balls, tmp_path):
    shares = []
    finish(two_balls, tmp_path, lambda stage, frame, share, *_: shares.append(share), until="tracking", global_rounds=2)
    assert shares == sorted(shares) and shares[-1] <= 1
