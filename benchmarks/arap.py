"""As-rigid-as-possible deformation beside libigl and Open3D: the same mesh, handles and iterations, end energy and time.

    make peers
    python -m benchmarks.arap [--vertices 20000 --iterations 10]

A torus is held on one side and turned on the other. The energy is the plain one (spokes, cotangent weights), evaluated for the
three results by one function of its own. Times are the least of several runs: "first" from the mesh to the first result,
"next" for one more frame with other targets of the same handles, which Open3D has no way to prepare for.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable

import numpy as np
from scipy import sparse
from scipy.spatial.transform import Rotation

from refmesh_addon.core.deformation.arap import ArapSolver
from refmesh_addon.core.types import TriangleMesh

MAJOR, MINOR, ASPECT = 1.0, 0.4, 2  # radii, and how many more vertices go around the large circle than around the small one
HELD = 1.2  # |x| beyond which vertices are handles
TURNS = (60.0, 70.0)  # degrees by which the handles of one side turn, in the first and in the next frame
SHIFT = (0.3, 0.2, 0.1)
TRIALS = 3

Frames = list[np.ndarray]  # (R, 3) for each frame
Method = Callable[[TriangleMesh, np.ndarray, Frames, int], tuple[Frames, list[float]]]


def torus(vertices: int) -> TriangleMesh:
    """A closed torus of about so many vertices, about z."""
    around = round((vertices / ASPECT) ** 0.5)
    along = ASPECT * around
    u, v = np.meshgrid(np.arange(along) * 2 * np.pi / along, np.arange(around) * 2 * np.pi / around, indexing="ij")
    v = v + 0.5 * u * along / around  # sheared, so that triangles are far from right-angled
    radius = MAJOR + MINOR * np.cos(v)
    points = np.stack([radius * np.cos(u), radius * np.sin(u), MINOR * np.sin(v)], axis=-1).reshape(-1, 3)
    index = np.arange(along * around).reshape(along, around)
    a, b = index, np.roll(index, -1, axis=1)
    c, d = np.roll(index, -1, axis=0), np.roll(np.roll(index, -1, axis=0), -1, axis=1)
    return TriangleMesh(points, np.concatenate([np.stack([a, c, b], -1), np.stack([b, c, d], -1)]).reshape(-1, 3))


def task(mesh: TriangleMesh) -> tuple[np.ndarray, Frames]:
    """Handles (K,), and their (K, 3) targets in each frame."""
    x = mesh.vertices[:, 0]
    handles = np.flatnonzero(np.abs(x) > HELD)
    places, moving = mesh.vertices[handles], x[handles] > 0
    turned = [Rotation.from_euler("x", angle, degrees=True).apply(places) + SHIFT for angle in TURNS]
    return handles, [np.where(moving[:, None], frame, places) for frame in turned]


def energy(mesh: TriangleMesh, positions: np.ndarray) -> float:
    """Sum over i and j in N(i) of w_ij |(p'_i - p'_j) - R_i (p_i - p_j)|^2, with the best R_i, w the mean of two cotangents."""
    corners = mesh.triangles
    i, j, opposite = corners.ravel(), corners[:, [1, 2, 0]].ravel(), corners[:, [2, 0, 1]].ravel()
    a, b = mesh.vertices[i] - mesh.vertices[opposite], mesh.vertices[j] - mesh.vertices[opposite]
    half = 0.5 * np.einsum("ni,ni->n", a, b) / np.linalg.norm(np.cross(a, b), axis=1)
    i, j, weights = np.concatenate([i, j]), np.concatenate([j, i]), np.tile(half, 2)
    before, after = mesh.vertices[i] - mesh.vertices[j], positions[i] - positions[j]
    products = weights[:, None] * (after[:, :, None] * before[:, None, :]).reshape(-1, 9)
    gather = sparse.csr_matrix((np.ones(len(i)), (i, np.arange(len(i)))))
    u, _, vt = np.linalg.svd((gather @ products).reshape(-1, 3, 3))
    u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
    missed = after - np.einsum("nij,nj->ni", (u @ vt)[i], before)
    return float(weights @ np.square(missed).sum(axis=1))


def by_refmesh(mesh: TriangleMesh, handles: np.ndarray, targets: Frames, iterations: int) -> tuple[Frames, list[float]]:
    began, ends, results = time.perf_counter(), [], []
    solver = ArapSolver(mesh, smoothness=0.0)
    for frame in targets:
        results.append(solver.deform(handles, frame, mesh.vertices, weight=np.inf, iterations=iterations).vertices)
        ends.append(time.perf_counter())
    return results, np.diff([began, *ends]).tolist()


def by_libigl(mesh: TriangleMesh, handles: np.ndarray, targets: Frames, iterations: int) -> tuple[Frames, list[float]]:
    import igl

    vertices, triangles = mesh.vertices.copy(), mesh.triangles.astype(np.int64)
    began, ends, results = time.perf_counter(), [], []
    data = igl.ARAPData()
    data.energy, data.max_iter = igl.ARAP_ENERGY_TYPE_SPOKES, iterations
    igl.arap_precomputation(vertices, triangles, 3, handles.astype(np.int32), data)
    for frame in targets:
        results.append(igl.arap_solve(frame, data, vertices.copy()))
        ends.append(time.perf_counter())
    return results, np.diff([began, *ends]).tolist()


def by_open3d(mesh: TriangleMesh, handles: np.ndarray, targets: Frames, iterations: int) -> tuple[Frames, list[float]]:
    import open3d

    began, ends, results = time.perf_counter(), [], []
    geometry, utility = open3d.geometry, open3d.utility
    body = geometry.TriangleMesh(utility.Vector3dVector(mesh.vertices.copy()), utility.Vector3iVector(mesh.triangles.copy()))
    for frame in targets:
        places = utility.IntVector(handles.astype(np.int32)), utility.Vector3dVector(frame)
        results.append(np.asarray(body.deform_as_rigid_as_possible(*places, iterations).vertices))
        ends.append(time.perf_counter())
    return results, np.diff([began, *ends]).tolist()


METHODS: dict[str, Method] = {"refmesh": by_refmesh, "libigl": by_libigl, "open3d": by_open3d}


def compared(methods: dict[str, Method], mesh: TriangleMesh, iterations: int, trials: int) -> dict[str, dict[str, float]]:
    """Energy and seconds of each method, in turns so that all see the same noise of the machine."""
    handles, targets = task(mesh)
    seconds, energies = {name: [] for name in methods}, {}
    for _ in range(trials):
        for name, method in methods.items():
            results, times = method(mesh, handles, targets, iterations)
            seconds[name].append(times)
            energies[name] = energy(mesh, results[0])
    return {name: {"energy": energies[name], **dict(zip(("first", "next"), np.min(seconds[name], axis=0).tolist()))} for name in methods}


def main() -> None:
    """Runs all three, prints a table and then one line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vertices", type=int, default=20_000)
    parser.add_argument("--iterations", type=int, default=10)
    parser.add_argument("--methods", nargs="+", default=list(METHODS), choices=METHODS, help="of refmesh, libigl, open3d")
    arguments = parser.parse_args()
    mesh = torus(arguments.vertices)
    results = compared({name: METHODS[name] for name in arguments.methods}, mesh, arguments.iterations, TRIALS)
    for name, result in results.items():
        print(f"{name:8}  energy {result['energy']:.6f}  first {result['first']:.3f} s  next {result['next']:.3f} s")
    ours = results.get("refmesh", next(iter(results.values())))
    ratios = {name: {key: result[key] / ours[key] for key in ours} for name, result in results.items()}
    counts = {"vertices": len(mesh.vertices), "iterations": arguments.iterations}
    print(json.dumps({"benchmark": "arap", **counts, "methods": results, "ratios_to_ours": ratios}))


if __name__ == "__main__":
    main()
