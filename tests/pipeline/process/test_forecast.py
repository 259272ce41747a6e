"""How far a job is and how long it will take, with a clock that the test turns."""

from __future__ import annotations

import pytest

from refmesh_addon.core.settings import Settings
from refmesh_addon.pipeline.process.forecast import STEPS, Forecast, StageTime
from refmesh_addon.pipeline.process.measurements import PLACE_VARIABLE, measurements_path, remember, stage_times
from refmesh_addon.pipeline.session.job import CHECK, STAGES, JobSpec

FRAMES = 10


class Job:
    """A forecast of two stages whose clock runs as fast as the test says; what is measured is kept."""

    def __init__(self, tracking: StageTime, reference: StageTime):
        self.now, self.measured = 0.0, {}
        times = {"tracking": tracking, "reference": reference}
        self.forecast = Forecast(times, FRAMES, self.measured.__setitem__, lambda: self.now)

    def work(self, stage: str, start: float, end: float, seconds: float, steps: int = 50) -> list[float | None]:
        """Time left after each step of a part of a stage."""
        left = []
        for step in range(steps + 1):
            self.forecast.advance(stage, start + (end - start) * step / steps)
            left.append(self.forecast.left)
            self.now += seconds / steps if step < steps else 0.0
        return left


def test_a_job_that_takes_what_it_took_last_is_foreseen_to_the_second():
    job = Job(StageTime(6.0, measured=True), StageTime(4.0, measured=True))
    left = job.work("tracking", 0.0, 1.0, 60.0) + job.work("reference", 0.0, 1.0, 40.0)
    assert left[0] == pytest.approx(100.0) and left[50] == pytest.approx(40.0) and left[-1] == pytest.approx(0.0)
    assert job.forecast.share == pytest.approx(1.0, abs=0.02)


def test_parts_of_a_stage_weigh_what_they_took():
    """The second half of the progress took nine tenths of the time."""
    curve = tuple(0.2 * step / STEPS if 2 * step <= STEPS else 0.1 + 1.8 * (step / STEPS - 0.5) for step in range(STEPS + 1))
    job = Job(StageTime(10.0, curve, measured=True), StageTime(0.0, measured=True))
    job.work("tracking", 0.0, 0.5, 10.0)
    assert job.forecast.left == pytest.approx(90.0) and job.forecast.share == pytest.approx(0.1)


def test_a_stage_that_is_looked_at_before_its_time_is_one_measurement():
    """A review fits some frames, without progress of the stage, and goes back; the rest follows later."""
    job = Job(StageTime(6.0, measured=True), StageTime(4.0, measured=True))
    job.work("tracking", 0.0, 1.0, 60.0)
    job.work("reference", 0.0, 0.0, 10.0)
    job.work("tracking", 0.0, 0.0, 2.0)
    assert job.forecast.left == pytest.approx(40.0 - 12.0) and job.forecast.share == pytest.approx(0.6)
    job.work("reference", 0.0, 1.0, 30.0)
    assert job.forecast.left == pytest.approx(0.0)
    job.forecast.end()
    assert job.measured["reference"].seconds == pytest.approx(4.0) and job.measured["tracking"].seconds == pytest.approx(6.2)


def test_what_a_stage_does_again_is_left_to_do_and_what_it_looks_up_is_not():
    job = Job(StageTime(6.0, measured=True), StageTime(4.0, measured=True))
    job.work("tracking", 0.0, 1.0, 60.0)
    job.work("reference", 0.0, 1.0, 40.0)
    shares = [job.forecast.share]
    job.forecast.advance("reference", 0.5, skipped=True)
    assert job.forecast.left == pytest.approx(0.0), "an earlier result is read"
    for start in (0.5, 0.75):
        left = job.work("reference", start + 0.01, start + 0.25, 10.0)
        shares.append(job.forecast.share)
    assert left[0] == pytest.approx(10.0, rel=0.1), "a quarter of the stage is done again"
    assert all(before <= after < 1.0 for before, after in zip(shares, shares[1:]))
    job.forecast.end()
    assert job.measured["reference"].seconds == pytest.approx(6.0), "all of its visits"


def test_what_an_earlier_run_has_done_does_not_count():
    job = Job(StageTime(6.0, measured=True), StageTime(4.0, measured=True))
    job.forecast.advance("tracking", 1.0, skipped=True)
    job.forecast.advance("reference", 0.5, skipped=True)
    assert job.forecast.left == pytest.approx(20.0) and job.forecast.share == 0.0
    job.work("reference", 0.5, 0.75, 10.0)
    assert job.forecast.left == pytest.approx(10.0) and job.forecast.share == pytest.approx(0.5)
    assert job.measured == {}, "a part of a stage is no measurement of it"


def test_nothing_is_foretold_before_something_is_known():
    job = Job(StageTime(6.0), StageTime(4.0))
    assert set(job.work("tracking", 0.0, 0.01, 4.0)) == {None}
    job.work("tracking", 0.01, 0.5, 296.0)
    assert job.forecast.left == pytest.approx(300.0 + 400.0, rel=0.01), "ten times slower than the rough weights say"


def test_stages_that_were_done_as_a_whole_are_measured():
    job = Job(StageTime(1.0), StageTime(1.0))
    job.work("tracking", 0.0, 0.5, 10.0)
    job.work("tracking", 0.5, 1.0, 30.0)
    job.work("reference", 0.0, 1.0, 20.0)
    job.forecast.end()
    assert job.measured["tracking"].seconds == pytest.approx(4.0) and job.measured["reference"].seconds == pytest.approx(2.0)
    assert job.measured["tracking"].passed(0.5) == pytest.approx(0.25)


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.setenv(PLACE_VARIABLE, str(tmp_path / "new" / "times.json"))
    return measurements_path()


def spec(**settings) -> JobSpec:
    return JobSpec("frames", "out", settings=Settings.from_flat(settings))


def test_times_are_remembered_for_their_settings_and_roughly_for_others(place):
    taken = StageTime(7.5, measured=True)
    remember(spec(centers=77), "tracking", taken)
    assert stage_times(spec(centers=77))["tracking"] == taken
    other = stage_times(spec(centers=78))
    assert other["tracking"].seconds == 7.5 and not other["tracking"].measured
    assert list(other) == list(STAGES) and not any(other[stage].measured for stage in STAGES)
    assert list(stage_times(JobSpec("frames", "out", until=CHECK))) == [CHECK]


@pytest.mark.parametrize("text", ["", "[]", '{"tracking": 3}', '{"tracking": {"seconds": "x", "curve": []}}', "{"])
def test_a_damaged_file_of_times_is_as_good_as_none(place, text):
    expected = stage_times(spec())
    place.parent.mkdir()
    place.write_text(text)
    assert stage_times(spec()) == expected
    remember(spec(), "tracking", StageTime(1.0, measured=True))
    assert stage_times(spec())["tracking"].measured


def test_a_place_that_cannot_be_written_stops_nothing(place):
    place.parent.write_text("a file in the way")
    remember(spec(), "tracking", StageTime(1.0))
    assert not stage_times(spec())["tracking"].measured


def test_colors_that_are_not_wanted_take_no_time(place):
    remember(spec(), "color", StageTime(3.0))
    assert stage_times(spec())["color"].seconds == 3.0 and stage_times(spec(texture="off"))["color"].seconds == 0.0
