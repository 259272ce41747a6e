"""Choosing the frames that one mesh of a take is made from."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

from benchmarks.frames import frames_folder
from benchmarks.segment_mesh import apartness

from ..core.shapes import ball, joined, moved, torus

ROOT = Path(__file__).resolve().parents[2]
FAST = {"centers": 40, "resolution": 32, "group_size": 2, "alignment_steps": 0, "triangles": 500, "fit_rounds": 1, "samples": 200}


def test_more_components_come_before_lower_genus_and_that_before_area():
    two, one, handle = joined(ball(2), ball(2, center=(3.0, 0, 0))), ball(2), torus()
    assert apartness(two)[:2] == (2, 0) and apartness(one)[:2] == (1, 0) and apartness(handle)[:2] == (1, -1)
    assert apartness(two) > apartness(moved(one, scale=9.0)) > apartness(one) > apartness(moved(handle, scale=9.0))


def test_each_choice_is_measured(tmp_path):
    source = frames_folder("tumble", 3, tmp_path)
    options = [item for name, value in FAST.items() for item in ("--set", f"{name}={value}")]
    command = [sys.executable, "-m", "benchmarks.segment_mesh", str(source), *options]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    rows = json.loads(done.stdout.splitlines()[-1])["rows"]
    assert set(rows) == {"all", "first", "apart"}
    assert all(np.isfinite(list(row.values())).all() and row["components"] == 1 and row["mean"] > 0 for row in rows.values())
