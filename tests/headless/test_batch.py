"""Many takes by one command, as a person starts it."""

from __future__ import annotations

import csv
import shutil

from .test_run import TINY, frames, run  # noqa: F401  (a fixture)


def test_one_failing_take_stops_no_other_and_is_counted(frames, tmp_path):  # noqa: F811
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "scan_1.obj").write_text("this is no mesh")
    (tmp_path / "takes.csv").write_text("input,output,frames,centers\nbroken,,,\nbox,second,20-21,3\nbox/box_*.obj,third,21-22,17\n")
    done = run("--batch", "takes.csv", "--output", "out", *TINY, cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    with open(tmp_path / "out" / "batch_summary.csv", newline="") as file:
        summary = {row["take"]: row for row in csv.DictReader(file)}
    assert {name: row["result"] for name, row in summary.items()} == {"broken": "failed", "second": "failed", "third": "done"}
    assert "scan_1.obj" in summary["broken"]["message"] and "--centers" in summary["second"]["message"]
    assert (summary["third"]["frames"], summary["second"]["exit_code"]) == ("2", "2")
    assert done.stdout.splitlines()[-1] == "3 takes, 1 done, 2 failed"
    assert all(summary[name]["message"] in done.stdout for name in summary)
    assert "[3/3] third" in done.stderr
    assert {"scene.blend", "report.json"} <= {path.name for path in (tmp_path / "out" / "third").iterdir()}
    assert not (tmp_path / "out" / "second").exists()


def test_a_folder_of_takes_can_be_checked(frames, tmp_path):  # noqa: F811
    takes = tmp_path / "takes"
    shutil.copytree(frames, takes / "a")
    (takes / "b").mkdir()
    done = run("--batch", takes, "--output", tmp_path / "out", "--check", "--quiet")
    assert done.returncode == 1, done.stderr
    assert "nothing found" in done.stdout and "no meshes found" in done.stdout


def test_a_batch_that_cannot_begin_runs_nothing(frames, tmp_path):  # noqa: F811
    both = run(frames, "--batch", tmp_path, "--output", tmp_path / "out")
    assert both.returncode == 2 and "either INPUT or --batch" in both.stderr
    missing = run("--batch", "missing.csv", "--output", "out", cwd=tmp_path)
    assert (missing.returncode, missing.stdout) == (126, "") and "missing.csv" in missing.stderr
    (tmp_path / "batch_summary.csv").write_text("my own table\n")
    kept = run("--batch", tmp_path, "--output", tmp_path)
    assert kept.returncode == 126 and "is kept" in kept.stderr
    assert (tmp_path / "batch_summary.csv").read_text() == "my own table\n"
