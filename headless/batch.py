"""Many takes by one command: each in a process of its own, so that one that fails, or even crashes Blender, stops no other."""

from __future__ import annotations

import csv
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path

from takes import BatchError, Columns, Take, read_takes

# Codes above this have meanings of their own in a shell, so more failures than that are not counted.
MOST_FAILED = 125
EXIT_NOT_BEGUN = 126
EXIT_INTERRUPTED = 130
SUMMARY_NAME = "batch_summary.csv"
STOP_GRACE = 15.0  # seconds that an interrupted take may need to end by itself
LINES = 20  # of stderr that are looked through for what went wrong


@dataclass(frozen=True)
class BatchJob:
    """batch : CSV file or folder.  output : with a folder for each take.  options : for all takes.  preview : name of a picture
    in the output folder of each take, or "".  show : whether to print what each take prints.  command : starts a single job.
    """

    batch: Path
    output: Path
    options: tuple[str, ...]
    preview: str
    show: bool
    command: tuple[str, ...]


@dataclass(frozen=True)
class Outcome:
    """One row of the summary; the fields are its columns. distance : of the worst frame from its source, mean, % of the diagonal."""

    take: str
    result: str
    exit_code: int | str
    frames: int | str
    meshes: int | str
    distance: str
    warnings: int | str
    seconds: float | str
    output: str
    message: str


def run_batch(job: BatchJob, columns: Columns) -> int:
    """Runs the takes one after the other and prints a table. Returns how many failed, as an exit code."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends as with Ctrl-C: the take at work is stopped, the table written
    try:
        if os.path.isabs(job.preview):
            raise BatchError("--preview: every take would write the same picture; give a name without folders, for each take's own folder")
        takes = read_takes(job.batch, job.output, columns)
        _check_summary(job.output / SUMMARY_NAME)
    except BatchError as error:
        print(error, file=sys.stderr)
        return EXIT_NOT_BEGUN
    outcomes: list[Outcome] = []
    try:
        for index, take in enumerate(takes, 1):
            print(f"[{index}/{len(takes)}] {take.name}", file=sys.stderr, flush=True)
            outcomes.append(_run_take(job, take))
    except KeyboardInterrupt:
        outcomes += [Outcome(take.name, "not run", "", "", "", "", "", "", str(take.output), "") for take in takes[len(outcomes) :]]
        _summarize(job, outcomes)
        return EXIT_INTERRUPTED
    _summarize(job, outcomes)
    return min(sum(outcome.result == "failed" for outcome in outcomes), MOST_FAILED)


def _run_take(job: BatchJob, take: Take) -> Outcome:
    preview = [f"--preview={take.output / job.preview}"] if job.preview else []
    command = [*job.command, take.source, "--output", str(take.output), *preview, *job.options, *take.options]
    start, tail = time.monotonic(), deque(maxlen=LINES)
    with subprocess.Popen(command, stdout=None if job.show else subprocess.DEVNULL, stderr=subprocess.PIPE) as process:
        try:
            _pass_on(process, tail)
        except KeyboardInterrupt:
            _stop(process)
            raise
    seconds = round(time.monotonic() - start, 1)
    if process.returncode == 0:
        return Outcome(take.name, "done", 0, *_figures(take.output), seconds, str(take.output), "")
    crashed = f"ended by signal {-process.returncode}" if process.returncode < 0 else ""
    message = crashed or next((line for line in reversed(tail) if line), f"exit code {process.returncode}")
    return Outcome(take.name, "failed", process.returncode, "", "", "", "", seconds, str(take.output), message)


def _pass_on(process: subprocess.Popen, tail: deque[str]) -> None:
    """Shows stderr as it comes, progress bars included, and keeps its last lines."""
    rest = b""
    while chunk := os.read(process.stderr.fileno(), 1 << 16):
        sys.stderr.buffer.write(chunk)
        sys.stderr.flush()
        *lines, rest = re.split(rb"[\r\n]", rest + chunk)
        tail.extend(line.decode("utf-8", "replace").strip() for line in lines)
    tail.append(rest.decode("utf-8", "replace").strip())
    process.wait()


def _stop(process: subprocess.Popen) -> None:
    process.send_signal(signal.SIGTERM if os.name == "nt" else signal.SIGINT)
    try:
        process.wait(STOP_GRACE)
    except subprocess.TimeoutExpired:
        process.kill()


def _figures(output: Path) -> tuple[int | str, int | str, str, int | str]:
    """Frames, meshes, worst distance and warnings of a finished take; blank where it wrote no report, as after a check."""
    try:
        report = json.loads((output / "report.json").read_text(encoding="utf-8"))
        means = [frame["source_to_deformed"]["mean"] for frame in report["frames"] if "between" not in frame]
        return len(report["frames"]), len(report["groups"]), f"{100 * max(means):.4f}", len(report["warnings"])
    except (OSError, ValueError, LookupError, TypeError):
        return "", "", "", ""


def _check_summary(path: Path) -> None:
    """Raises BatchError where somebody else's file has the name of the summary."""
    try:
        with open(path, encoding="utf-8") as file:
            ours = file.readline().strip() == ",".join(_heads())
    except FileNotFoundError:
        return
    except (OSError, UnicodeDecodeError):
        ours = False
    if not ours:
        raise BatchError(f"{path}: is not a summary that RefMesh wrote, so it is kept; move it or choose another output folder")


def _summarize(job: BatchJob, outcomes: Sequence[Outcome]) -> None:
    """Prints the table and writes it as CSV."""
    failed = sum(outcome.result == "failed" for outcome in outcomes)
    rows = [["take", "result", "frames", "meshes", "distance", "warnings", "seconds", ""]]
    rows += [[str(value) for value in (*astuple(outcome)[:2], *astuple(outcome)[3:8], outcome.message)] for outcome in outcomes]
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    for row in rows:
        print("  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip())
    done, noun = sum(outcome.result == "done" for outcome in outcomes), "take" if len(outcomes) == 1 else "takes"
    print(f"{len(outcomes)} {noun}, {done} done, {failed} failed", flush=True)
    path = job.output / SUMMARY_NAME
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_name(SUMMARY_NAME + ".refmesh-partial")
        with open(partial, "w", encoding="utf-8", newline="") as file:
            csv.writer(file).writerows([_heads(), *map(astuple, outcomes)])
        os.replace(partial, path)
    except OSError as error:
        print(f"{path}: cannot be written ({error.strerror or error})", file=sys.stderr)


def _heads() -> list[str]:
    return [item.name for item in fields(Outcome)]
