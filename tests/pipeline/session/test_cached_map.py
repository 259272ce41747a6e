"""Units of work: done where they are missing, kept at once, read when asked for."""

import os
from dataclasses import dataclass, replace

import numpy as np
import pytest

from refmesh_addon.core.errors import Canceled, RefMeshError
from refmesh_addon.core.types import FrozenArrays
from refmesh_addon.pipeline.session.cache import Cache, digest
from refmesh_addon.pipeline.session.cached_map import WorkUnit, cached_map
from refmesh_addon.pipeline.session.session import Session
from refmesh_addon.pipeline.session.stage_share import StageShare

from ..running import shared_workers

SHARE = StageShare("tracking", 0.5, 1.0)


@dataclass(frozen=True)
class Power(FrozenArrays):
    values: np.ndarray
    exponent: int


@dataclass(frozen=True)
class OtherFields:
    mean: float


def raised(values: np.ndarray, exponent: int) -> Power:
    return Power(values**exponent, exponent)


def raised_but_for_two(values: np.ndarray, exponent: int) -> Power:
    if exponent == 2:
        raise RefMeshError("the square is not wanted")
    return raised(values, exponent)


def raised_but_dies_at_two(values: np.ndarray, exponent: int) -> Power:
    return os._exit(1) if exponent == 2 else raised(values, exponent)


def mean(values: np.ndarray, exponent: int) -> OtherFields:
    return OtherFields(float(values.mean()))


class Job:
    """A folder, and what is said and asked while units are done there."""

    def __init__(self, folder):
        self.folder, self.told, self.asked = folder, [], []

    def notify(self, stage, frame, share, skipped=False):
        self.told.append((stage, frame, share))

    def units(self, *exponents, version=1) -> dict[str, WorkUnit]:
        return {f"to the {k}": WorkUnit(f"power/{k:03d}", digest(version, k), self._arguments(k), 10 + k) for k in exponents}

    def _arguments(self, exponent):
        def arguments():
            self.asked.append(exponent)
            return np.arange(4.0), exponent

        return arguments

    def run(self, units, function=raised, kind=Power, failed=None, notify=None, **cache):
        session = Session(self.folder, Cache(self.folder, **cache), shared_workers(), notify or self.notify)
        return cached_map(session, function, units, kind, SHARE, failed)


@pytest.fixture
def job(tmp_path):
    return Job(tmp_path)


def test_results_are_those_of_a_plain_loop(job):
    results = job.run(job.units(*range(20)))
    assert list(results) == [f"to the {k}" for k in range(20)] and len(results) == 20
    for k, result in enumerate(results.values()):
        assert result.exponent == k
        np.testing.assert_array_equal(result.values, np.arange(4.0) ** k)


def test_only_what_is_missing_or_changed_is_done(job):
    job.run(job.units(0, 1, 2))
    job.asked.clear()
    assert job.run(job.units(0, 1, 2, 3))["to the 3"].exponent == 3
    assert job.asked == [3]
    job.run(job.units(1, version=2))
    assert job.asked == [3, 1]


def test_a_damaged_entry_and_one_with_other_fields_are_done_again(job):
    job.run(job.units(0, 1, 2))
    (path,) = job.folder.glob("power/001-*.npz")
    path.write_bytes(path.read_bytes()[:100])
    job.asked.clear()
    assert job.run(job.units(0, 1, 2))["to the 1"].exponent == 1
    assert job.asked == [1]
    assert job.run(job.units(0), mean, OtherFields)["to the 0"].mean == 1.5


def test_a_unit_that_ends_its_process_is_named_and_the_others_are_done(job):
    units = {name: replace(unit, subject=f"/in/{name}.obj") for name, unit in job.units(*range(5)).items()}
    failures = {}
    assert list(job.run(units, raised_but_dies_at_two, failed=failures.__setitem__)) == [f"to the {k}" for k in (0, 1, 3, 4)]
    assert list(failures) == ["to the 2"] and str(failures["to the 2"]).startswith("/in/to the 2.obj: the worker process died")
    with pytest.raises(RefMeshError, match="/in/to the 2.obj: the worker process died"):
        job.run(units, raised_but_dies_at_two)


def test_results_are_read_only_when_asked_for(job, monkeypatch):
    results = job.run(job.units(*range(5)))
    read = []
    load = Cache.load
    monkeypatch.setattr(Cache, "load", lambda self, name, key, declared=None: read.append(name) or load(self, name, key))
    assert len(results) == 5 and "to the 2" in results and not read
    assert results["to the 2"] is results["to the 2"]
    assert read == ["power/002"]
    first = results["to the 3"]
    assert results["to the 2"].exponent == 2 and results["to the 3"] is not first, "only the last one is held"


def test_an_entry_that_disappears_is_named(job):
    results = job.run(job.units(0))
    (path,) = job.folder.glob("power/*.npz")
    path.unlink()
    with pytest.raises(RefMeshError, match="start the run again") as caught:
        results["to the 0"]
    assert str(path) in str(caught.value)


def test_progress_stays_in_its_part_of_the_stage_and_names_each_frame(job):
    job.run(job.units(*range(4)))
    assert {stage for stage, _, _ in job.told} == {"tracking"}
    shares = [share for _, _, share in job.told]
    assert shares == sorted(shares) and (shares[0], shares[-1]) == (0.5, 1.0)
    assert {frame for _, frame, _ in job.told} == {None, 10, 11, 12, 13}


def test_a_canceled_map_keeps_what_is_done(job):
    def notify(stage, frame, share, skipped=False):
        if share > 0.7:
            raise Canceled

    with pytest.raises(Canceled):
        job.run(job.units(*range(8)), notify=notify)
    done = {int(path.name[:3]) for path in job.folder.glob("power/*.npz")}
    assert 0 < len(done) < 8
    job.asked.clear()
    assert len(job.run(job.units(*range(8)))) == 8
    assert set(job.asked) == set(range(8)) - done


def test_the_first_error_ends_the_map_unless_somebody_takes_it(job):
    with pytest.raises(RefMeshError, match="square"):
        job.run(job.units(1, 2), raised_but_for_two)
    errors = {}
    results = job.run(job.units(1, 2, 3), raised_but_for_two, failed=errors.__setitem__)
    assert set(results) == {"to the 1", "to the 3"}
    assert {name: str(error) for name, error in errors.items()} == {"to the 2": "the square is not wanted"}
    assert job.run(job.units(1, 2, 3))["to the 2"].exponent == 2, "an error is not kept"


def test_without_resume_everything_is_done_again(job):
    job.run(job.units(0, 1))
    job.asked.clear()
    assert job.run(job.units(0, 1), resume=False)["to the 0"].exponent == 0
    assert job.asked == [0, 1]


def test_no_units_give_no_results(job):
    assert dict(job.run({})) == {}
