"""Draws docs/pictures/cluster.svg: a take on four Dask workers of this machine, one of which is killed.

Not part of `make pictures`: times differ from run to run. Usage: python docs/make_cluster_picture.py
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path

import matplotlib.pyplot as plt
from distributed import Client, get_task_stream

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
from benchmarks.frames import frames_folder  # noqa: E402
from refmesh_addon.core.presets import PRESETS  # noqa: E402
from refmesh_addon.core.settings import Settings  # noqa: E402
from refmesh_addon.pipeline.run import run  # noqa: E402
from refmesh_addon.pipeline.session.job import JobSpec  # noqa: E402

WORKERS, FRAMES = 4, 24
HOST = "127.0.0.1"
KILLED_AT = 0.3  # share of the deformation
# Function -> what it does, in the order of the legend.
WORK = {
    "capture": "read frames",
    "place_centers": "reference centers",
    "align_to_anchor": "align frames",
    "build_with": "build meshes",
    "deform_reference": "deform",
    "smooth_block": "smooth",
    "measure": "measure",
}


def main() -> None:
    with tempfile.TemporaryDirectory() as scratch, ExitStack() as stack:
        start(stack, scratch, "scheduler", "--port", "0")
        workers = [start(stack, scratch, "worker", "--no-nanny", "--nthreads", "1") for _ in range(WORKERS)]
        client = stack.enter_context(Client(scheduler_file=str(Path(scratch) / "scheduler.json")))
        client.wait_for_workers(WORKERS)
        settings = Settings.from_flat({**PRESETS["draft"], "segments": "groups"})
        job = JobSpec(
            str(frames_folder("bar", FRAMES)), scratch + "/out", settings=settings, until="evaluation", scheduler=client.scheduler.address
        )

        def notify(stage, frame, share, skipped=False):
            if stage == "deformation" and share > KILLED_AT and len(workers) == WORKERS:
                workers.pop().kill()

        with get_task_stream(client=client) as stream:
            run(job, notify, print)
        draw(stream.data)


def start(stack: ExitStack, folder: str, kind: str, *arguments: str) -> subprocess.Popen:
    arguments = (*arguments, "--host", HOST, "--no-dashboard", "--scheduler-file", "scheduler.json")
    process = subprocess.Popen([sys.executable, "-m", "dask", kind, *arguments], cwd=folder)
    stack.callback(process.wait)
    stack.callback(process.kill)
    return process


def draw(tasks: list[dict]) -> None:
    """One row of bars for each worker."""
    parts = [(task["worker"], task["key"].split("-")[0], part) for task in tasks for part in task["startstops"]]
    bars = [bar for bar in parts if bar[1] in WORK and bar[2]["action"] == "compute"]
    begin = min(part["start"] for *_, part in bars)
    rows = sorted({worker for worker, *_ in bars}, key=lambda one: -max(part["stop"] for worker, _, part in bars if worker == one))
    colors = dict(zip(WORK, plt.get_cmap("tab10").colors))
    figure, axes = plt.subplots(figsize=(9, 2.6), layout="constrained")
    for worker, name, part in bars:
        length, left = part["stop"] - part["start"], part["start"] - begin
        axes.barh(rows.index(worker), length, left=left, color=colors[name], edgecolor="white", lw=0.3)
    last = max(part["stop"] for worker, _, part in bars if worker == rows[-1]) - begin
    axes.plot(last, len(rows) - 1, "kx", label="killed")
    for name, label in WORK.items():
        axes.barh(0, 0, color=colors[name], label=label)
    axes.set(yticks=range(len(rows)), yticklabels=[f"worker {row + 1}" for row in range(len(rows))], xlabel="seconds")
    axes.invert_yaxis()
    axes.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside right center", frameon=False)
    figure.savefig(ROOT / "docs" / "pictures" / "cluster.svg", metadata={"Date": None})


if __name__ == "__main__":
    main()
