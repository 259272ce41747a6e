"""How long the timeline takes to show another frame of a sequence: from memory, from the binary cache, and from the mesh file.

    python -m benchmarks.frame_change [--vertices 20000] [--frames 24] [--input FOLDER]

Frames are shown in random order, by `Scene.frame_set`, which includes Blender's own update of the scene.
"""

from __future__ import annotations

import argparse
import json
import random
import tempfile
import time
from pathlib import Path

import bpy
import numpy as np
import trimesh

import refmesh_addon
from headless.run import claim_stdout
from refmesh_addon.bridge.sequence import raw_sequence as sequence

LIMIT = 20.0  # milliseconds that a change to a frame of 20,000 vertices may take
NOTHING, PLENTY = 1, 4096  # megabytes: the last frame only, and every frame


def make_frames(folder: Path, vertices: int, count: int) -> None:
    """Spheres that grow, as OBJ, each with a triangulation of its own."""
    rows = round((vertices / 2) ** 0.5)
    for number in range(1, count + 1):
        ball = trimesh.creation.uv_sphere(radius=1 + 0.01 * number, count=[rows + number % 3, rows])
        (folder / f"ball_{number:04d}.obj").write_text(trimesh.exchange.obj.export_obj(ball, include_normals=False))


def times(owner: bpy.types.Object, order: list[int]) -> np.ndarray:
    """Milliseconds of each change."""
    taken = []
    for scene_frame in order:
        before = time.perf_counter()
        bpy.context.scene.frame_set(scene_frame)
        taken.append(1e3 * (time.perf_counter() - before))
        assert owner.refmesh.shown == sequence.frame_at(owner, scene_frame).name
    return np.array(taken)


def percentile(taken: np.ndarray, share: float) -> float:
    return round(float(np.percentile(taken, share)), 2)


def main() -> None:
    """Prints the median and the 95th percentile of each way, then one line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vertices", type=int, default=20_000)
    parser.add_argument("--frames", type=int, default=24)
    parser.add_argument("--input", type=Path, help="a sequence to take instead of generated spheres")
    arguments = parser.parse_args()
    stdout = claim_stdout()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    refmesh_addon.register()
    with tempfile.TemporaryDirectory() as scratch:
        folder = arguments.input or Path(scratch)
        if not arguments.input:
            make_frames(folder, arguments.vertices, arguments.frames)
        bpy.ops.refmesh.import_sequence(filepath=str(folder))
        owner = bpy.context.active_object
        frames = [frame.scene_frame for frame in owner.refmesh.frames]
        order = random.Random(0).sample(frames[1:], len(frames) - 1)
        owner.refmesh.output = str(Path(scratch) / "out")
        ways = {}
        sequence.set_memory_budget(NOTHING)
        ways["file"] = times(owner, order)
        bpy.ops.refmesh.check_sequence(quiet=True)
        ways["cache"] = times(owner, order * 3)
        sequence.set_memory_budget(PLENTY)
        times(owner, order)
        ways["memory"] = times(owner, order * 3)
        vertices = len(owner.data.vertices)
    refmesh_addon.unregister()
    figures = {f"{way}_ms": {"median": percentile(taken, 50), "p95": percentile(taken, 95)} for way, taken in ways.items()}
    for way, figure in figures.items():
        print(f"{way:10} median {figure['median']:6.1f}  95th percentile {figure['p95']:6.1f}", file=stdout)
    ratio = float(np.median(ways["file"]) / np.median(ways["cache"]))
    last = {"benchmark": "frame_change", "vertices": vertices, "limit_ms": LIMIT, **figures, "file_over_cache": round(ratio, 1)}
    print(json.dumps(last), file=stdout, flush=True)


if __name__ == "__main__":
    main()
