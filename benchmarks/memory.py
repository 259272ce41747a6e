"""Whether long takes need more memory, or more processor time per frame, than short ones: whole jobs by the real worker process.

    python -m benchmarks.memory [--frames 30 300 ...] [--until evaluation] [--source sample_scenes/textured_grasp/frames]

Longer takes are the first one played to and fro, so that its groups hold the same frames; with pictures beside the frames of --source,
colors are brought over too. All stages run, and one mesh serves the take (--segments long). Meshes are of usual size, so that anything
that is held of every frame shows; the settings spare all work that memory does not depend on. The peak is that of the main process and,
for each worker process, that of the largest: which of them gets the largest group is chance. The size of the cache is told too.
Needs the /proc file system of Linux.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import resource
import shutil
import subprocess
import sys
import tempfile
import threading
from dataclasses import dataclass
from pathlib import Path

# Nothing here may load numpy: a child starts with the peak of the process that it was split from.
from refmesh_addon.core.settings import STAGES, Settings
from refmesh_addon.pipeline.process.client import WORKER_MODULE
from refmesh_addon.pipeline.process.environment import python_executable, worker_environment
from refmesh_addon.pipeline.process.events import Event
from refmesh_addon.pipeline.session.job import JobSpec

SEQUENCE = "bar"
MESHES = (".ply", ".obj", ".glb", ".stl", ".off")
# Little work for each frame; the number of triangles alone decides how much is made of it.
FAST = {"alignment_steps": 1, "poisson_depth": 6, "arap_iterations": 1, "fit_rounds": 1, "samples": 500}
SMALLEST = 32 * 2**20  # bytes; smaller processes belong to Python itself, not to the pool
POLL = 0.1  # seconds between two readings; each process states its own peak, so only its last moments may be missed


@dataclass(frozen=True)
class Measured:
    """One take: its frames, bytes of the main process and of the largest worker process at their peaks, processor seconds per frame,
    and bytes of the cache.
    """

    frames: int
    main: int
    worker: int
    workers: int
    pace: float
    cache: int

    @property
    def peak(self) -> int:
        """Of all processes, where each of the workers is at its peak, bytes."""
        return self.main + self.workers * self.worker


class PeakMemory(threading.Thread):
    """Reads the peak resident memory of a process and all its descendants while they run."""

    def __init__(self, pid: int):
        super().__init__(daemon=True)
        self._pid, self._peaks, self._ended = pid, {}, threading.Event()

    def run(self) -> None:
        """Reads until `stop` is called."""
        while not self._ended.wait(POLL):
            for pid in descendants(self._pid):
                self._peaks[pid] = max(self._peaks.get(pid, 0), peak_of(pid))

    def stop(self) -> tuple[int, list[int]]:
        """The peak of the process and those of its descendants, bytes."""
        self._ended.set()
        self.join()
        return self._peaks.pop(self._pid, 0), list(self._peaks.values())


def descendants(pid: int) -> list[int]:
    """The process itself, its children, their children, and so on."""
    children: dict[int, list[int]] = {}
    for folder in Path("/proc").iterdir():
        with contextlib.suppress(OSError, ValueError, IndexError):  # one that ended meanwhile, or no process
            parent = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
            children.setdefault(parent, []).append(int(folder.name))
    found = [pid]
    for one in found:
        found += children.get(one, [])
    return found


def peak_of(pid: int) -> int:
    """Peak resident memory of a process, bytes; 0 when it has ended."""
    with contextlib.suppress(OSError):
        for line in Path(f"/proc/{pid}/status").read_text().splitlines():
            if line.startswith("VmHWM:"):
                return 1024 * int(line.split()[1])
    return 0


def measured(frames: list[Path], count: int, settings: Settings, until: str) -> Measured:
    """Runs a job of `count` frames in a worker of its own."""
    with tempfile.TemporaryDirectory() as scratch:
        take = Path(scratch) / "take"
        take.mkdir()
        for beside in {*frames[0].parent.iterdir()}.difference(frames):
            shutil.copyfile(beside, take / beside.name)
        for number, frame in enumerate(to_and_fro(frames, count), 1):
            shutil.copyfile(frame, take / f"take_{number:04d}{frame.suffix}")
        job = Path(scratch) / "job.json"
        job.write_text(JobSpec(str(take), str(Path(scratch) / "out"), settings=settings, until=until).to_json(), encoding="utf-8")
        before = processor_seconds()
        main, others = run_worker(job)
        workers = [peak for peak in others if peak > SMALLEST]
        cache = sum(path.stat().st_size for path in Path(scratch, "out", "cache").rglob("*.npz"))
        return Measured(count, main, max(workers, default=0), len(workers), (processor_seconds() - before) / count, cache)


def to_and_fro(frames: list[Path], count: int) -> list[Path]:
    """`count` frames: the given ones forwards, backwards, and so on, the frame at a turn twice, so that groups stay the same."""
    loop = frames + frames[::-1]
    return [loop[index % len(loop)] for index in range(count)]


def run_worker(job: Path) -> tuple[int, list[int]]:
    """Runs a job and gives the peak of its main process and those of all others, bytes."""
    command = [python_executable(), "-m", WORKER_MODULE, str(job)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=worker_environment()) as process:
        memory = PeakMemory(process.pid)
        memory.start()
        last = Event("failed", "it left no message")
        for line in process.stdout:
            last = Event.from_line(line.decode()) or last
        peaks = memory.stop()
    if last.kind != "done":
        sys.exit(f"the worker ended with '{last.kind}': {last.message}")
    return peaks


def processor_seconds() -> float:
    """Of all processes that were started from here and have ended, with what these have started."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def generated(arguments: argparse.Namespace) -> Path:
    """Folder of generated frames, made in a process of its own."""
    makes = [sys.executable, "-m", "benchmarks.frames", SEQUENCE, str(arguments.frames[0])]
    makes += ["--cache", str(arguments.cache)] if arguments.cache else []
    return Path(subprocess.run(makes, check=True, stdout=subprocess.PIPE, text=True).stdout.strip())


def main() -> None:
    """Runs takes of each length, prints a table and then one line of JSON; its ratios are of the last take to the first."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", nargs="+", type=int, default=(30, 300))
    parser.add_argument("--centers", type=int, default=100)
    parser.add_argument("--resolution", type=int, default=64)
    parser.add_argument("--triangles", type=int, default=15_000, help="of each reference mesh (default: %(default)s)")
    parser.add_argument("--texture", default="512", help="side of the textures of a colored take in pixels (default: %(default)s)")
    parser.add_argument("--source", type=Path, help="folder of frames, all of one format, in place of generated ones")
    parser.add_argument("--tracking", default="sequence", choices=("sequence", "group"))
    parser.add_argument("--until", default=STAGES[-1], choices=STAGES, help="the last stage (default: %(default)s)")
    parser.add_argument("--cache", type=Path, help="folder for generated frames")
    arguments = parser.parse_args()
    if not Path("/proc/self/status").exists():
        sys.exit("this system has no /proc: measure memory on Linux")
    chosen = {name: getattr(arguments, name) for name in ("centers", "resolution", "triangles", "tracking", "texture")}
    settings = Settings.from_flat({**FAST, **chosen})
    frames = sorted(path for path in (arguments.source or generated(arguments)).iterdir() if path.suffix in MESHES)
    takes = []
    for count in arguments.frames:
        takes.append(take := measured(frames, count, settings, arguments.until))
        sizes = f"main process {take.main / 2**20:.1f} MiB, {take.workers} workers of at most {take.worker / 2**20:.1f} MiB"
        print(
            f"{take.frames:5d} frames: {sizes}, {take.pace:.3f} processor seconds and "
            f"{take.cache / take.frames / 2**20:.2f} MiB of cache a frame",
            flush=True,
        )
    short, long = takes[0], takes[-1]
    figures = {"frames": arguments.frames, "until": arguments.until}
    figures |= {f"{name}_mebibytes": [round(getattr(take, name) / 2**20, 1) for take in takes] for name in ("main", "worker", "peak")}
    figures |= {"peak_ratio": long.peak / short.peak, "pace": [take.pace for take in takes], "pace_ratio": long.pace / short.pace}
    figures |= {"cache_mebibytes": [round(take.cache / 2**20, 1) for take in takes]}
    print(json.dumps({"benchmark": "memory", **figures}))


if __name__ == "__main__":
    main()
