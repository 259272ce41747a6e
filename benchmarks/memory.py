"""Whether a long take needs more memory, or more time per frame, than a short one: tracking by the real worker process.

    python -m benchmarks.memory [--frames 30 300]

The long take is the short one played to and fro, so that the motion from frame to frame is the same in both.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

# Nothing here may load numpy: a child starts with the peak of the process that it was split from.
from refmesh_addon.core.settings import Settings
from refmesh_addon.pipeline.process.client import WORKER_MODULE
from refmesh_addon.pipeline.process.environment import python_executable, worker_environment
from refmesh_addon.pipeline.process.events import Event
from refmesh_addon.pipeline.session.job import JobSpec

SEQUENCE = "bar"
PEAK_UNIT = 1 if sys.platform == "darwin" else 1024  # bytes in which the system states a peak
PART = 3  # the start and the end of a take are its first and last third


@dataclass(frozen=True)
class Measured:
    """One take: its frames, peak bytes, and seconds per frame in its first and last part."""

    frames: int
    peak: int
    start: float
    end: float


def measured(frames: list[Path], count: int, settings: Settings) -> Measured:
    """Tracks `count` frames in a worker of its own."""
    with tempfile.TemporaryDirectory() as scratch:
        take = Path(scratch) / "take"
        take.mkdir()
        for number, frame in enumerate(to_and_fro(frames, count), 1):
            shutil.copyfile(frame, take / f"take_{number:04d}{frame.suffix}")
        job = Path(scratch) / "job.json"
        job.write_text(JobSpec(str(take), str(Path(scratch) / "out"), settings=settings, until="tracking").to_json(), encoding="utf-8")
        events, peak = run_worker(job)
    # Frames are read first, and then tracked; while they are read the share done lags behind the frame.
    moments = [(event.frame, when) for event, when in events if (event.frame or 0) > 1 and event.share >= (event.frame - 1) / count]
    moments.append((count + 1, events[-1][1]))
    if len(moments) < 2:
        sys.exit(f"{count} frames are too few to time; give more with --frames")
    part = max(len(moments) // PART, 2)
    return Measured(count, peak, pace(moments[:part]), pace(moments[-part:]))


def to_and_fro(frames: list[Path], count: int) -> list[Path]:
    """`count` frames: the given ones forwards, backwards, and so on, the frame at a turn once."""
    loop = frames + frames[-2:0:-1]
    return [loop[index % len(loop)] for index in range(count)]


def run_worker(job: Path) -> tuple[list[tuple[Event, float]], int]:
    """What the worker said and when, in seconds, and its peak in bytes."""
    process = subprocess.Popen(
        [python_executable(), "-m", WORKER_MODULE, str(job)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=worker_environment()
    )
    heard = [(Event("failed", "it left no message"), time.perf_counter())]
    heard += [(event, time.perf_counter()) for line in process.stdout if (event := Event.from_line(line.decode()))]
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    process.stdin.close()
    last = heard[-1][0]
    if last.kind != "done":
        sys.exit(f"the worker ended with '{last.kind}': {last.message}")
    return heard, usage.ru_maxrss * PEAK_UNIT


def pace(moments: list[tuple[int, float]]) -> float:
    """Seconds per frame."""
    (first, began), (last, ended) = moments[0], moments[-1]
    return (ended - began) / (last - first)


def main() -> None:
    """Tracks a short and a long take, prints a table and then one line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", nargs=2, type=int, default=(30, 300), metavar=("SHORT", "LONG"))
    parser.add_argument("--centers", type=int, default=300)
    parser.add_argument("--resolution", type=int, default=128)
    parser.add_argument("--cache", type=Path, help="folder for generated frames")
    arguments = parser.parse_args()
    settings = Settings.from_flat({"centers": arguments.centers, "resolution": arguments.resolution})
    makes = [sys.executable, "-m", "benchmarks.frames", SEQUENCE, str(arguments.frames[0])]
    makes += ["--cache", str(arguments.cache)] if arguments.cache else []
    folder = Path(subprocess.run(makes, check=True, stdout=subprocess.PIPE, text=True).stdout.strip())
    takes = [measured(sorted(folder.iterdir()), count, settings) for count in arguments.frames]
    for take in takes:
        print(f"{take.frames:5d} frames: peak {take.peak / 2**20:.1f} MiB, {take.start:.3f} s a frame at first, {take.end:.3f} s at last")
    short, long = takes
    figures = {"frames": arguments.frames, "peak_mebibytes": [round(take.peak / 2**20, 1) for take in takes]}
    figures |= {"peak_ratio": long.peak / short.peak, "pace_start": long.start, "pace_end": long.end, "pace_ratio": long.end / long.start}
    print(json.dumps({"benchmark": "memory", **figures}))


if __name__ == "__main__":
    main()
