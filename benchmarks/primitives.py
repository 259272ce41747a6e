"""How flat the faces of a box and how round a ball are in meshes: python -m benchmarks.primitives MESH... or the folder of a job

For captures of simple bodies, such as a box and a ball that collide. Each component is held against the sphere and against
the six planes that fit it best; the closer one is reported, in % of the radius or of the box's longest side, and of its shortest.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
import trimesh

from refmesh_addon.core.geometry.mesh import merged, sample_surface, submesh, triangle_normals, vertex_components
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.meshes import read_mesh

SAMPLES = 50_000
FACING = 0.7  # least cosine between the normal of a triangle and the axis of the face it counts for
RIM = 0.2  # width of what does not count along the edges of a face, which may be rounded, in shortest sides
LEAST_BODY = 0.01  # share of the whole surface that makes a component a body


def main() -> None:
    """Prints a row for each body of each mesh, and all of them as one line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", nargs="+", type=Path, help="meshes, or the folder of a job, whose reference meshes count")
    arguments = parser.parse_args()
    rows = []
    for path in arguments.meshes:
        for file in sorted((path / "reference").glob("group_*.ply")) if path.is_dir() else [path]:
            for body in bodies(merged(read_mesh(file))[0]):
                rows.append({"mesh": file.name, **shape(body)})
                print(*(f"{key} {value}" for key, value in rows[-1].items()), sep="  ", flush=True)
    print(json.dumps({"benchmark": "primitives", "rows": rows}))


def bodies(mesh: TriangleMesh) -> list[TriangleMesh]:
    """Components that are larger than floaters."""
    count, component = vertex_components(mesh)
    owner = component[mesh.triangles[:, 0]]
    kept = np.flatnonzero(np.bincount(owner, minlength=count) >= LEAST_BODY * len(owner))
    return [submesh(mesh, owner == index)[0] for index in kept]


def shape(body: TriangleMesh) -> dict[str, str | float]:
    """Which primitive a body is, and how far its surface is from it: 99th percentile and maximum, %."""
    points, owners = sample_surface(body, SAMPLES, np.random.default_rng(0))
    radius, off_sphere = _from_sphere(points)
    sides, off_faces = _from_faces(body, points, triangle_normals(body)[owners])
    if np.median(off_sphere) / radius < np.median(off_faces) / max(sides):
        return {"kind": "ball", "triangles": len(body.triangles), **_shares(off_sphere, radius)}
    shares = _shares(off_faces, max(sides)) | _shares(off_faces, min(sides), "_of_shortest")
    return {"kind": "box", "triangles": len(body.triangles), **shares}


def _shares(distances: np.ndarray, length: float, suffix: str = "") -> dict[str, float]:
    errors = {"p99": np.percentile(distances, 99), "max": distances.max()}
    return {f"{name}{suffix}": round(100 * float(value) / length, 3) for name, value in errors.items()}


def _from_sphere(points: np.ndarray) -> tuple[float, np.ndarray]:
    """Radius of the least-squares sphere, and distances from it."""
    middle = points.mean(axis=0)
    rows = np.column_stack([2 * (points - middle), np.ones(len(points))])
    solved = np.linalg.lstsq(rows, ((points - middle) ** 2).sum(axis=1), rcond=None)[0]
    radius = np.sqrt(solved[3] + (solved[:3] ** 2).sum())
    return radius, np.abs(np.linalg.norm(points - middle - solved[:3], axis=1) - radius)


def _from_faces(body: TriangleMesh, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sides of the box around a body, and distances of the points of each of the six faces from its least-squares plane."""
    to_box, sides = trimesh.bounds.oriented_bounds(body.vertices)
    points, normals = trimesh.transform_points(points, to_box), normals @ to_box[:3, :3].T
    inner = np.abs(points) < sides / 2 - RIM * sides.min()
    distances = []
    for axis in range(3):
        for sign in (1, -1):
            face = points[(sign * normals[:, axis] > FACING) & np.delete(inner, axis, axis=1).all(axis=1)]
            if len(face) > 3:
                across = np.linalg.svd(face - face.mean(axis=0), full_matrices=False)[2][2]
                distances.append(np.abs((face - face.mean(axis=0)) @ across))
    return sides, np.concatenate(distances) if distances else np.array([np.inf])


if __name__ == "__main__":
    main()
