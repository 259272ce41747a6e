"""One camera against all round, in its smallest form."""

import numpy as np

from .test_benchmarks import cache, last_line, numbers  # noqa: F401  # a fixture

SETTINGS = {"centers": 60, "resolution": 40, "triangles": 1500, "fit_rounds": 2, "alignment_steps": 1, "samples": 1000}
SETTINGS |= {"segments": "groups"}


def test_one_camera_is_nearly_as_near_as_all_round_and_drifts_little(cache):  # noqa: F811
    options = [part for name, value in SETTINGS.items() for part in ("--set", f"{name}={value}")]
    found = last_line("one_camera", "--cases", "tumble", "--frames", "2", *options, "--cache", str(cache))
    (case,) = found["cases"].values()
    assert np.isfinite(numbers(found)).all()
    assert 0.5 < case["kept"] < 1.0 and case["unseen"] < 0.5
    assert abs(case["ratio"] - case["mean"] / case["all_round_mean"]) < 0.02
    assert case["drift_median"] < 2.0
