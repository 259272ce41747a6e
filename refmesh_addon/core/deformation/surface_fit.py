"""Fits a deformed reference to the source surface, beyond the paper: ARAP with closest-point constraints, in rounds.

Every round pairs vertices and centroids of triangles of each surface with the other (in both directions, so that thin parts that
were missed are reached), and solves the ARAP system with those pairs as soft constraints. Their weights grow and limits tighten
from round to round. The rest shape is the start itself, not the reference mesh: what is kept is the shape in which the centers
left it, so that a surface that really stretches is not made to slide. A closest point lies straight above or below, so a pair
holds a vertex where it is along the surface, except for the little that planes allow in the later rounds.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..geometry.mesh import mean_edge_length, triangle_areas
from ..progress import Progress, ignore
from ..reference.budget import DENSE_TRIANGLES
from ..types import FrozenArrays, TriangleMesh
from .arap import ArapSolver
from .arap_system import Constraints, Start, Targets
from .cap_targets import CapTargets
from .correspondence import Correspondence, Pairs
from .feature_targets import FeatureTargets
from .folds import Facing
from .partners import Limits

# Each from the first to the last round, in equal ratios.
PULL = (1.0, 300.0)  # weight of a pair, where an edge of a regular mesh weighs 0.58; the last leaves noise, not misfit, to ARAP
REACH = (0.04, 0.015)  # farthest partner as a share of the square root of the area: some 5 and 2 edges of a 20k-vertex body
COSINE = (0.3, 0.5)  # least agreement of the two normals: 73 and 60 degrees
# A finer mesh reaches only this many edges in the last round, and is pulled by area instead of by vertex: it bends at shorter
# wavelengths, and would follow crossing pairs there. With 79k vertices six times as many triangles flipped without this.
LAST_EDGES = 2.0

# The first half of the rounds uses every ninth sample and pulls to points: the surface is still rough, and the result
# measures the same. The second half uses every third, the last round all of them, and both pull to planes, so that vertices
# reach edges and creases beside them. More plane steps come nearer to the source by a tenth, but each frame then drifts its own way
# along the surface: with five, vertices of a bending bar accelerate 1.55 times as much as its centers, with three 1.4 times.
EARLY_STRIDE, LATE_STRIDE, PLANE_STEPS = 9, 3, 3

# A vertex of a triangle that folded over keeps this share of its pull and gains the rest back by doubling, round by round.
FOLD_TRUST, TRUST_GROWTH = 0.1, 2.0

# How far below the source, in mean edge lengths, surface is placed that the source does not show, so that its edges stay below as
# well. In the second half of the rounds only: in the first, surface may still be on its way to where it belongs.
INSET = 0.15


@dataclass(frozen=True)
class FitResult(FrozenArrays):
    """vertices : (R, 3) scene units.
    residuals : (rounds,) mean distance of the pairs before each round, scene units; 0 where there is no pair.
    held : (R,) bool, True where no pair touched the vertex in the last round and ARAP alone placed it.
    """

    vertices: np.ndarray
    residuals: np.ndarray
    held: np.ndarray


@dataclass(frozen=True)
class Unpaired:
    """Targets in a frame of what closest points leave to chance.

    lines : that must stay lines.  caps : that close holes; None for none of either.
    """

    lines: FeatureTargets | None = None
    caps: CapTargets | None = None


NOTHING = Unpaired()


@dataclass(frozen=True)
class Round:
    """limits : of its pairs.  pull : weight of a pair.  planes : whether pairs pull to planes.  inset : scene units."""

    limits: Limits
    pull: float
    planes: bool
    inset: float


def fit_surface(
    solver: ArapSolver,
    start: np.ndarray,
    correspondence: Correspondence,
    rounds: int = 6,
    progress: Progress = ignore,
    unpaired: Unpaired = NOTHING,
) -> FitResult:
    """The deformation near `start` that lies on the source.

    start : (R, 3) deformed reference, scene units, off the source by a few edge lengths at most.
    correspondence : of the source with the solver's mesh.  rounds : 0 returns the start.  unpaired : targets of lines and caps.
    Raises ValueError where start does not match the solver's mesh.

    >>> from refmesh_addon.core.deformation.correspondence import SurfaceIndex, SurfaceSampler
    >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> raised = SurfaceIndex(square.moved(square.vertices + [0, 0, 0.01]))
    >>> fit = fit_surface(ArapSolver(square), square.vertices, Correspondence(raised, SurfaceSampler(square)))
    >>> fit.vertices[:, 2].round(3)
    array([0.01, 0.01, 0.01, 0.01])
    """
    fit, residuals = _Fit(solver, solver.mesh.moved(np.asarray(start, dtype=np.float64)), correspondence, unpaired), np.zeros(rounds)
    for number, setting in enumerate(schedule(fit.mesh, rounds)):
        residuals[number] = fit.advance(setting)
        progress((number + 1) / rounds)
    return FitResult(fit.mesh.vertices, residuals, ~fit.touched)


def schedule(start: TriangleMesh, rounds: int) -> Iterator[Round]:
    """The rounds of a fit, from loose to tight.  start : the surface before them."""
    size, length = np.sqrt(triangle_areas(start).sum()), mean_edge_length(start)
    fine = min(1.0, LAST_EDGES * length / (REACH[1] * size))
    ends = (PULL[0], fine**2 * PULL[1]), (REACH[0], fine * REACH[1]), COSINE
    for number in range(rounds):
        pull, reach, cosine = (_between(pair, number, rounds) for pair in ends)
        early, last = number < rounds // 2, number == rounds - 1
        stride = 1 if last else EARLY_STRIDE if early else LATE_STRIDE
        yield Round(Limits(reach * size, cosine, stride), pull, not early, 0.0 if early else INSET * length)


class _Fit:
    """The surface on its way to the source.

    mesh, rotations : at present.  trust : (R,) share of its pull that a vertex has.  touched : (R,) bool, in a pair of the last round.
    """

    def __init__(self, solver: ArapSolver, start: TriangleMesh, correspondence: Correspondence, unpaired: Unpaired):
        count = len(start.vertices)
        self._solver, self._correspondence, self._unpaired = solver, correspondence, unpaired
        self._start, self._rest = start, solver.energy.rest_shape(start.vertices)
        self.mesh, self.rotations = start, np.tile(np.eye(3), (count, 1, 1))  # the start is the rest shape
        self.trust, (self.touched, self._on_caps) = np.ones(count), np.zeros((2, count), dtype=bool)

    def advance(self, setting: Round) -> float:
        """One round; returns the mean distance of its pairs, 0 where there is none."""
        reached = self._correspondence.from_reference(self.mesh, setting.limits, setting.inset)
        reaching = self._correspondence.from_source(self.mesh, self._of_source(setting.limits), setting.planes)
        # As many vertices' worth from each side: a dense source must not outweigh the reference's own samples.
        weights = [self._weights(side, setting.pull) for side in (reached, reaching)]
        pairs = reached.joined(reaching)
        self._solve(pairs, np.concatenate(weights), setting)
        folded = _at_folds(self.mesh, Facing(self._start, self.rotations, self._correspondence.source))
        self.trust = np.where(folded, FOLD_TRUST * self.trust, np.minimum(TRUST_GROWTH * self.trust, 1.0))
        return pairs.distances.mean() if len(pairs.distances) else 0.0

    def _of_source(self, limits: Limits) -> Limits:
        """Before the last round, a dense source needs no more samples than the reference has."""
        excess = len(self._correspondence.source.mesh.triangles) // max(len(self.mesh.triangles), DENSE_TRIANGLES // 2)
        return replace(limits, stride=limits.stride * max(excess, 1)) if limits.stride > 1 else limits

    def _weights(self, pairs: Pairs, pull: float) -> np.ndarray:
        count = len(self.trust)
        return (pull * self.trust)[pairs.corners].min(axis=1) * pairs.weights * (count / max(len(pairs.corners), 1))

    def _solve(self, pairs: Pairs, weights: np.ndarray, setting: Round) -> None:
        """One ARAP iteration."""
        count = len(self.trust)
        touched = np.zeros(count, dtype=bool)
        touched[pairs.corners[pairs.shares != 0]] = True
        if self._unpaired.caps is not None and setting.planes:
            caps = self._unpaired.caps.pairs(self.mesh, setting.limits, self._on_caps)
            self._on_caps[caps.corners[:, 0]] = True
            pairs, weights = pairs.joined(caps), np.append(weights, (setting.pull * self.trust)[caps.corners[:, 0]] * caps.weights)
        rows = pairs.rows(count)
        fixed, goals = self._lines(setting)
        targets = Targets(pairs.targets, goals, normals=pairs.normals if setting.planes else None, plane_steps=PLANE_STEPS)
        system = self._solver.system(Constraints(rows, weights, fixed))
        deformation = system.solve(targets, Start(self.mesh.vertices, self.rotations), 1, rest=self._rest)
        self.mesh, self.rotations = self.mesh.moved(deformation.vertices), deformation.rotations
        touched[fixed] = True
        self.touched = touched

    def _lines(self, setting: Round) -> tuple[np.ndarray, np.ndarray]:
        """Vertices that go to the lines of the source exactly, and where: in the later rounds, those that are not at a fold."""
        if self._unpaired.lines is None or not setting.planes:
            return np.zeros(0, dtype=np.int64), np.zeros((0, 3))
        vertices, goals = self._unpaired.lines.goals(self.mesh)
        trusted = self.trust[vertices] == 1.0
        return vertices[trusted], goals[trusted]


def _at_folds(mesh: TriangleMesh, facing: Facing) -> np.ndarray:
    """(R,) bool, whether a triangle at the vertex is folded."""
    result = np.zeros(len(mesh.vertices), dtype=bool)
    result[mesh.triangles[facing.folded(mesh.vertices)]] = True
    return result


def _between(ends: tuple[float, float], number: int, count: int) -> float:
    """Value of round `number` of `count`, in equal ratios; a single round has the last."""
    share = number / (count - 1) if count > 1 else 1.0
    return ends[0] * (ends[1] / ends[0]) ** share
