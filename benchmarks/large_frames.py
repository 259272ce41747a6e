"""Memory and time of each stage for frames of very many triangles: a subdivided bar with fine relief, by the real worker process.

    python -m benchmarks.large_frames [--triangles 630000] [--frames 2] [--preset draft]

The peak is that of the largest process. Needs the /proc file system of Linux.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path

import numpy as np
import trimesh

from benchmarks.frames import CACHE, frames_folder
from benchmarks.memory import processor_seconds, run_worker
from refmesh_addon.core.presets import PRESETS
from refmesh_addon.core.settings import STAGES, Settings
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.ply import write_ply
from refmesh_addon.pipeline.session.job import JobSpec

SEQUENCE, STEPS = "bar", 20  # frames at these steps of time, so that successive ones are near each other
RELIEF, WAVES = 0.0015, 25.0  # height and number of waves of the relief, in sizes of the bounding-box diagonal


def large_frame(mesh: TriangleMesh, triangles: int) -> TriangleMesh:
    """The mesh, subdivided to at least so many triangles, with a relief that only fine triangles show."""
    fine = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    while len(fine.faces) < triangles:
        fine = fine.subdivide()
    phase = 2 * np.pi * WAVES * (fine.vertices - fine.vertices.mean(axis=0)) / mesh.diagonal
    height = RELIEF * mesh.diagonal * np.sin(phase).prod(axis=1)
    return TriangleMesh(fine.vertices + height[:, None] * fine.vertex_normals, fine.faces)


def main() -> None:
    """Runs the stages one after the other, prints a row for each and then one line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--triangles", type=int, default=630_000, help="of each frame, at least (default: %(default)s)")
    parser.add_argument("--frames", type=int, default=2)
    parser.add_argument("--preset", default="draft", choices=PRESETS)
    parser.add_argument("--until", default="evaluation", choices=STAGES)
    arguments = parser.parse_args()
    if not Path("/proc/self/status").exists():
        sys.exit("this system has no /proc: measure memory on Linux")
    with tempfile.TemporaryDirectory() as scratch:
        take, rows = Path(scratch, "take"), []
        take.mkdir()
        for path in sorted(frames_folder(SEQUENCE, STEPS, CACHE).glob("*.ply"))[: arguments.frames]:
            frame = large_frame(read_mesh(path), arguments.triangles)
            write_ply(take / path.name, frame)
        for stage in STAGES[: STAGES.index(arguments.until) + 1]:
            job, before = Path(scratch, "job.json"), processor_seconds()
            spec = JobSpec(str(take), str(Path(scratch, "out")), settings=Settings.from_flat(PRESETS[arguments.preset]), until=stage)
            job.write_text(spec.to_json(), encoding="utf-8")
            main_peak, others = run_worker(job)
            peak, seconds = max([main_peak, *others]), (processor_seconds() - before) / arguments.frames
            rows.append({"stage": stage, "peak_mebibytes": round(peak / 2**20, 1), "seconds_per_frame": round(seconds, 1)})
            print(f"{stage:12} {peak / 2**20:8.1f} MiB in the largest process, {seconds:6.1f} processor seconds a frame", flush=True)
        report = json.loads(Path(scratch, "out", "report.json").read_text(encoding="utf-8"))
    errors = [100 * entry["source_to_deformed"]["mean"] for entry in report["frames"] if "source_to_deformed" in entry]
    figures = {"triangles": len(frame.triangles), "frames": arguments.frames, "stages": rows, "mean_percent": max(errors, default=None)}
    print(json.dumps({"benchmark": "large_frames", **figures}))


if __name__ == "__main__":
    main()
