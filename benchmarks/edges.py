"""How sharp edges, rims and caps of a capture come out in a finished job: python -m benchmarks.edges OUT

For each frame, in % of the diagonal of its bounding box: how far points on the sharp edges of the source, and on the rims of its holes,
are from the sharp edges of the deformed mesh; how far the deformed surface over holes is from a fair cap; and its roughness, the
angle in degrees between neighboring triangles there.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from refmesh_addon.core.capture.cleaning import cleaned
from refmesh_addon.core.capture.floaters import without_floaters
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.geometry.feature_lines import SHARP, feature_edges, line_samples
from refmesh_addon.core.geometry.half_edges import HalfEdges
from refmesh_addon.core.geometry.mesh import submesh, triangle_normals
from refmesh_addon.core.geometry.vectors import row_dot
from refmesh_addon.core.surfacing.hole_caps import CappedMesh, smoothly_capped
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.discovery import find_sequence
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.report import read_report

STEP = 1e-4  # of points on lines, as a share of the diagonal
PERCENTILES = (50, 95, 100)


def main() -> None:
    """Prints a row for each frame, and all of them as one line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, help="the folder of a finished job")
    folder = parser.parse_args().out
    report, rows = read_report(folder), []
    deformed = {frame["number"]: folder / frame["deformed"] for frame in report["frames"]}
    for frame in find_sequence(report["input"], "").frames:
        if frame.number in deformed:
            source = smoothly_capped(without_floaters(cleaned(read_mesh(frame.path)).mesh))
            rows.append({"frame": frame.number, **figures(source, read_mesh(deformed[frame.number]))})
            print(*(f"{key} {value}" for key, value in rows[-1].items()), sep="  ", flush=True)
    print(json.dumps({"benchmark": "edges", "rows": rows}))


def figures(source: CappedMesh, deformed: TriangleMesh) -> dict[str, list[float]]:
    """Median, 95th percentile and maximum of each kind that the source has."""
    lines = feature_edges(source.mesh)
    at_rim = (source.holes[lines.triangles] >= 0).any(axis=1)
    edges, angles = edges_and_angles(deformed)
    length = source.mesh.diagonal
    sharp = cKDTree(line_samples(deformed.vertices[edges[angles > SHARP]], STEP * length)[0]) if (angles > SHARP).any() else None
    result = {}
    for name, chosen in (("edges", lines.edges[~at_rim]), ("rims", lines.edges[at_rim])):
        if len(chosen) and sharp is not None:
            result[name] = _percentiles(100 * sharp.query(line_samples(source.mesh.vertices[chosen], STEP * length)[0])[0] / length)
    if (source.holes >= 0).any():
        nearest = SurfaceIndex(source.mesh).query(deformed.vertices)
        over = source.holes[nearest.triangles] >= 0
        if over.any():
            cap = SurfaceIndex(submesh(source.mesh, source.holes >= 0)[0])
            result["cap"] = _percentiles(100 * cap.query(deformed.vertices[over]).distances / length)
            inner = over[edges].all(axis=1)
            result["roughness"] = _percentiles(np.degrees(angles[inner])) if inner.any() else []
    return result


def edges_and_angles(mesh: TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
    """(E, 2) edges with two triangles, and the angle between these, radians."""
    table = HalfEdges.of(mesh)
    one, other = triangle_normals(mesh)[table.pairs.T // 3]
    return table.edges[table.face_counts == 2], np.arccos(np.clip(row_dot(one, other), -1.0, 1.0))


def _percentiles(values: np.ndarray) -> list[float]:
    return [round(float(value), 4) for value in np.percentile(values, PERCENTILES)]


if __name__ == "__main__":
    main()
