"""Surface that a fit has stretched and squeezed side by side slides along the source until it has the lengths of the reference mesh.

The fit keeps the shape in which the centers left a surface. Where they have missed how cloth unfolds, a crest is spanned by a few long
triangles, and what belongs there lies squeezed beside it. Around such places the surface is fitted again, now as rigidly as possible
against the reference mesh, while the planes of the source leave it free to slide.
"""

from __future__ import annotations

import numpy as np

from ..geometry.mesh import mean_edge_length
from ..geometry.rings import vertices_around
from ..geometry.stretch import RestShape
from .arap import ArapSolver
from .arap_system import Constraints, Start, Targets
from .correspondence import Correspondence, Pairs
from .membrane import connected_patches
from .surface_fit import Round, schedule

STRETCHED, SQUEEZED = 2.2, 0.35  # factors of length beyond which no cloth goes
LEAST = 1e-3  # share of the triangles that must be stretched so far: a few are slivers, which sliding does not help
RINGS = 6  # of vertices around strained triangles that may slide
ROUNDS, ITERATIONS = 3, 3  # of closest points, and of ARAP in each
PULL = 100.0  # weight of a pair; with that of the last round of a fit, the surface hardly slides
# Of conjugate gradients in each iteration, which let the surface slide a little farther; few in the last round, for it to settle.
SLIDING, SETTLING = 12, 3
FARTHER = 0.02  # mean edge lengths by which the mean distance of a patch from the source may grow


class StrainRelief:
    """Built once from a solver, for all frames that its mesh is fitted to.  still : (R,) bool, vertices that never slide."""

    def __init__(self, solver: ArapSolver, still: np.ndarray):
        self._solver, self._rest, self._still = solver, RestShape(solver.mesh), still
        self._length = mean_edge_length(solver.mesh)

    def relieved(self, vertices: np.ndarray, correspondence: Correspondence, visible: np.ndarray) -> np.ndarray:
        """(R, 3) vertices of which those around strained triangles have slid, where this relieves them; unchanged where few are strained.

        vertices : (R, 3) on the source.  visible : (R,) bool, those that the source has placed; others may be strained.
        """
        stretched, squeezed = self._strains(vertices, visible)
        if np.count_nonzero(stretched) <= LEAST * len(stretched):
            return vertices
        around = vertices_around(self._solver.mesh, self._solver.energy.adjacency, stretched | squeezed, RINGS)
        free = around & visible & ~self._still
        if not free.any():
            return vertices
        moved = vertices
        rounds = list(schedule(self._solver.mesh.moved(vertices), 2 * ROUNDS))[ROUNDS:]
        for setting in rounds:
            steps = SETTLING if setting is rounds[-1] else SLIDING
            moved = self._slid(moved, free, self._pairs(moved, free, correspondence, setting), steps)
        return self._better(vertices, moved, free, correspondence)

    def _strains(self, vertices: np.ndarray, visible: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(S,) bool, visible triangles that are stretched, and those that are squeezed."""
        largest, smallest = self._rest.factors(vertices)
        shown = visible[self._solver.mesh.triangles].all(axis=1)
        return (largest > STRETCHED) & shown, (smallest < SQUEEZED) & shown

    def _pairs(self, vertices: np.ndarray, free: np.ndarray, correspondence: Correspondence, setting: Round) -> tuple[Pairs, np.ndarray]:
        """Pairs of one round that hold (R,) bool free vertices, and the weight of each."""
        mesh, count = self._solver.mesh.moved(vertices), len(vertices)
        sides = correspondence.from_reference(mesh, setting.limits, setting.inset), correspondence.from_source(mesh, setting.limits, True)
        weights = np.concatenate([PULL * side.weights * (count / max(len(side.corners), 1)) for side in sides])
        pairs = sides[0].joined(sides[1])
        near = np.flatnonzero(free[pairs.corners].any(axis=1))
        return pairs.where(near), weights[near]

    def _slid(self, vertices: np.ndarray, free: np.ndarray, pairs: tuple[Pairs, np.ndarray], plane_steps: int) -> np.ndarray:
        """(R, 3) vertices of which the (R,) bool free ones have moved as weighted pairs pull them."""
        kept, part = self._solver.part(free)
        fixed, (goals, weights) = np.flatnonzero(~free[kept]), pairs
        system = part.system(Constraints(goals.rows(len(vertices))[:, kept], weights, fixed))
        targets = Targets(goals.targets, vertices[kept[fixed]], normals=goals.normals, plane_steps=plane_steps)
        result = vertices.copy()
        result[kept] = system.solve(targets, Start(vertices[kept]), ITERATIONS).vertices
        return result

    def _better(self, before: np.ndarray, after: np.ndarray, free: np.ndarray, correspondence: Correspondence) -> np.ndarray:
        """(R, 3) the vertices after, in patches that are less strained than before and as near to the source; others as before."""
        chosen, patches = connected_patches(self._solver.energy.adjacency, free)
        strains, distances = [], []
        for vertices in (before, after):
            triangles = np.logical_or(*self._strains(vertices, free))
            strained = np.bincount(self._solver.mesh.triangles[triangles].ravel(), minlength=len(free))[chosen]
            strains.append(np.bincount(patches, strained))
            distances.append(np.bincount(patches, correspondence.source.query(vertices[chosen]).distances))
        near = distances[1] <= distances[0] + FARTHER * self._length * np.bincount(patches)
        result = before.copy()
        kept = chosen[((strains[1] < strains[0]) & near)[patches]]
        result[kept] = after[kept]
        return result
