"""Our surface reconstruction against PyMeshLab's, on the same points: python -m benchmarks.reconstruction INPUT [--frames 6-10]

The stages before the reconstruction run as in any job; then both build the reference mesh of each group from the same points.
Distances are between the points and the mesh, in % of the diagonal of the points; quality is 1 for a regular triangle.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.geometry.mesh import is_watertight, sample_surface, vertex_components
from refmesh_addon.core.geometry.self_intersection import crossing_triangles
from refmesh_addon.core.reference.support import without_bubbles
from refmesh_addon.core.settings import Settings
from refmesh_addon.core.surfacing import reconstruction, remeshing
from refmesh_addon.core.surfacing.edge_flips import quality
from refmesh_addon.io.discovery import find_sequence
from refmesh_addon.pipeline.session.context import Context
from refmesh_addon.pipeline.session.job import JobSpec
from refmesh_addon.pipeline.session.parallel import Workers
from refmesh_addon.pipeline.stages.meshlab import screened_poisson
from refmesh_addon.pipeline.stages.reference import align_groups, building_units
from refmesh_addon.pipeline.stages.segments import first_plan
from refmesh_addon.pipeline.stages.tracking import track_sequence

from . import meshlab

SAMPLES = 30_000
METHODS = {
    "ours": (reconstruction.screened_poisson, remeshing.remeshed),
    "pymeshlab": (screened_poisson, meshlab.remeshed),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("input", nargs="?", default="sample_scenes/grasp/frames", help="folder, file or pattern (default: the sample)")
    parser.add_argument("--frames", default="", help="numbers such as 6-10,14; empty takes all")
    arguments = parser.parse_args()
    rows = []
    for group, task in enumerate(building_tasks(arguments.input, arguments.frames)):
        for name, method in METHODS.items():
            rows.append({"group": group, "method": name, **measured(*task, *method)})
            print("  ".join(f"{key} {value}" for key, value in rows[-1].items()), flush=True)
    print(json.dumps({"benchmark": "reconstruction", "input": Path(arguments.input).name, "frames": arguments.frames, "rows": rows}))


def building_tasks(source: str, frames: str) -> list[tuple]:
    """Points, normals, spacing, triangles and depth of each group, from a job that stops short of the reference meshes."""
    with tempfile.TemporaryDirectory() as output, Workers() as workers:
        spec = JobSpec(source, output, frames, settings=Settings())
        context = Context.open(spec, find_sequence(source, frames), lambda stage, frame, share, *_: None, print, workers)
        tracking = track_sequence(context)
        aligned = align_groups(context, tracking, first_plan(context, tracking).grouped)
        tasks = (unit.arguments()[1:5] for unit in building_units(context, tracking, aligned).values())
        return [(surface.points, surface.normals, *sizes) for surface, *sizes in tasks]


def measured(points, normals, spacing, triangles, depth, reconstruct, remesh) -> dict:
    """Figures of one reference mesh."""
    start = time.process_time()
    surface = without_bubbles(reconstruct(points, normals, depth), points, spacing)
    reconstructed = time.process_time()
    mesh = remesh(surface, triangles)
    done = time.process_time()
    rng, diagonal = np.random.default_rng(0), float(np.linalg.norm(np.ptp(points, axis=0)))
    off = 100 / diagonal * SurfaceIndex(mesh).query(points[rng.choice(len(points), SAMPLES)]).distances
    back = 100 / diagonal * cKDTree(points).query(sample_surface(mesh, SAMPLES, rng)[0])[0]
    shapes = quality(mesh.vertices, mesh.triangles)
    return {
        "triangles": len(mesh.triangles),
        "components": vertex_components(mesh)[0],
        "watertight": is_watertight(mesh),
        "crossing": int(crossing_triangles(mesh).sum()),
        "points_to_mesh": {"mean": _short(off.mean()), "p99": _short(np.percentile(off, 99)), "max": _short(off.max())},
        "mesh_to_points": {"mean": _short(back.mean()), "p99": _short(np.percentile(back, 99))},
        "quality": {"median": _short(np.median(shapes)), "p1": _short(np.percentile(shapes, 1))},
        "seconds": {"reconstruction": _short(reconstructed - start), "remeshing": _short(done - reconstructed)},
    }


def _short(value: float) -> float:
    return round(float(value), 4)


if __name__ == "__main__":
    main()
