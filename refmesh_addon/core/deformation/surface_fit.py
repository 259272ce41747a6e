"""Pulls a deformed reference onto the source surface, beyond the paper: ARAP with closest-point constraints in rounds.

Every round pairs vertices and centres of triangles of each surface with the other (both ways, so that thin parts which were
missed are reached), and solves the ARAP system with those pairs as soft constraints. Pull grows and limits tighten from
round to round. The rest shape is the start itself, not the reference mesh: what is kept is the shape that was carried
here, so that a surface which truly stretches is not made to slide. A closest point lies straight above or below, so a pair
holds a vertex where it is along the surface, except for the little that planes allow in the later rounds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ..geometry.closest_point import SurfaceIndex
from ..geometry.mesh import mean_edge_length, triangle_areas
from ..geometry.winding import Enclosed
from ..progress import Progress, ignore
from ..settings import DeformationSettings
from ..types import FrozenArrays, TriangleMesh
from .arap import ArapSolver, Deformation
from .correspondence import Compatible, Correspondence, Limits, Pairs
from .folds import Facing

# Each from the first to the last round, in equal ratios.
PULL = (1.0, 300.0)  # weight of a pair, where an edge of a regular mesh weighs 0.58; the last leaves noise, not misfit, to ARAP
REACH = (0.04, 0.015)  # farthest partner as a share of the square root of the area: some 5 and 2 edges of a 20k-vertex body
# A finer mesh than that reaches as few edges in the last round, and is pulled by area instead of by vertex: it bends at shorter lengths,
# and what it would follow there are partners that cross. With 79k vertices six times as many triangles flipped without this.
LAST_EDGES = 2.0
COSINE = (0.3, 0.5)  # least agreement of the two normals: 73 and 60 degrees

# The first half of the rounds asks every ninth point and pulls to points: the surface is still rough, and the result
# measures the same. The second half asks every third, the last round all of them, and both pull to planes, so that vertices
# reach edges and creases beside them. More slides come nearer to the source by a tenth, but each frame goes its own way along the
# surface then: with five, vertices of a bending bar accelerate 1.55 times as much as its centers, with three 1.4 times.
EARLY_STRIDE, LATE_STRIDE, SLIDES = 9, 3, 3

# A vertex at a triangle that folded over keeps this share of its pull and gains the rest back by doubling, round by round.
FOLD_TRUST, TRUST_GROWTH = 0.1, 2.0

# How far below the source, in mean edge lengths, lies what it does not show, so that edges of triangles stay below as well.
# In the second half of the rounds only, as for what lies beside: before, surface may still be on its way to where it belongs.
INSET = 0.15


@dataclass(frozen=True)
class FitResult(FrozenArrays):
    """vertices : (R, 3) scene units.
    residuals : (rounds,) mean distance of the pairs before each round, scene units; 0 where there is no pair.
    held : (R,) bool, True where no pair touched the vertex in the last round and ARAP alone decided.
    """

    vertices: np.ndarray
    residuals: np.ndarray
    held: np.ndarray


def fit_surface(
    solver: ArapSolver,
    start: np.ndarray,
    source: SurfaceIndex,
    settings: DeformationSettings,
    compatible: Compatible | None = None,
    enclosed: Enclosed | None = None,
    progress: Progress = ignore,
) -> FitResult:
    """The deformation near `start` that lies on the source.

    start : (R, 3) deformed reference, scene units, off the source by a few edge lengths at most.
    compatible : (vertex ids, triangle ids) -> bool for each pair; pairs it refuses never pull, so a contact is not crossed.
    enclosed : by the source; found out where it is None.
    Uses `settings.fit_rounds`; 0 gives the start back. Raises ValueError where start does not match the solver's mesh.
    """
    mesh = solver.mesh.moved(np.asarray(start, dtype=np.float64))
    rest, size = mesh, np.sqrt(triangle_areas(mesh).sum())
    length = mean_edge_length(mesh)
    depth, fine = INSET * length, min(1.0, LAST_EDGES * length / (REACH[1] * size))
    ends = (PULL[0], fine**2 * PULL[1]), (REACH[0], fine * REACH[1]), COSINE
    correspondence = Correspondence(source, mesh, compatible, enclosed)
    trust, touched = np.ones(len(start)), np.zeros(len(start), dtype=bool)
    rotations = np.tile(np.eye(3), (len(start), 1, 1))  # those of a start that is the rest shape
    residuals = np.zeros(settings.fit_rounds)
    for number in range(settings.fit_rounds):
        pull, reach, cosine = (_between(pair, number, settings.fit_rounds) for pair in ends)
        early = number < settings.fit_rounds // 2
        last = number == settings.fit_rounds - 1
        limits = Limits(reach * size, cosine, 1 if last else EARLY_STRIDE if early else LATE_STRIDE)
        pairs = correspondence.from_reference(mesh, limits, 0.0 if early else depth), correspondence.from_source(mesh, limits, not early)
        distances = np.concatenate([side.distances for side in pairs])
        residuals[number] = distances.mean() if len(distances) else 0.0
        options = {"rest": rest.vertices, "rotations": rotations}
        deformation, touched = _solve(solver, pairs, pull * trust, mesh, options if early else {**options, "slides": SLIDES})
        mesh, rotations = mesh.moved(deformation.vertices), deformation.rotations
        trust = np.where(_folded(mesh, Facing(rest, rotations, source)), FOLD_TRUST * trust, np.minimum(TRUST_GROWTH * trust, 1.0))
        progress((number + 1) / settings.fit_rounds)
    return FitResult(mesh.vertices, residuals, ~touched)


def _solve(
    solver: ArapSolver, sides: tuple[Pairs, Pairs], pull: np.ndarray, mesh: TriangleMesh, options: dict
) -> tuple[Deformation, np.ndarray]:
    """One ARAP iteration with the pairs of both sides, and the (R,) bool of vertices in a pair.

    pull : (R,) weight of each vertex.  mesh : where it is now.  options : of the solution; with `slides` the pairs are planes.
    """
    count = len(pull)
    # As many vertices' worth from each side: a dense source must not outweigh its own smoothness.
    weights = [pull[side.corners].min(axis=1) * side.weights * (count / max(len(side.corners), 1)) for side in sides]
    rows = sparse.vstack([side.rows(count) for side in sides]).tocsr()
    targets, normals = (np.concatenate([getattr(side, name) for side in sides]) for name in ("targets", "normals"))
    planes = {"normals": normals} if "slides" in options else {}
    deformation = solver.system(rows, np.concatenate(weights)).solve(targets, mesh.vertices, 1, **options, **planes)
    touched = np.zeros(count, dtype=bool)
    touched[rows.indices] = True
    return deformation, touched


def _folded(mesh: TriangleMesh, facing: Facing) -> np.ndarray:
    """(R,) bool, whether a triangle at the vertex is folded."""
    result = np.zeros(len(mesh.vertices), dtype=bool)
    result[mesh.triangles[facing.folded(mesh.vertices)]] = True
    return result


def _between(ends: tuple[float, float], number: int, count: int) -> float:
    """Value of round `number` of `count`, in equal ratios; a single round has the last."""
    share = number / (count - 1) if count > 1 else 1.0
    return ends[0] * (ends[1] / ends[0]) ** share
