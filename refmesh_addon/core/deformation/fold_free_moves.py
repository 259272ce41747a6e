"""Moves vertices toward goals as far as no triangle folds over."""

from __future__ import annotations

import numpy as np

from .facing import Facing

PARTIAL_MOVES, PARTIAL_SHARE = 5, 0.5  # attempts of vertices that cannot go all the way, and the share of what is left that each tries


def moved_without_folds(facing: Facing, vertices: np.ndarray, goal: np.ndarray) -> np.ndarray:
    """(R, 3) vertices moved to (R, 3) goals, or toward them as far as that folds no triangle that is not folded already."""
    if np.array_equal(vertices, goal):
        return vertices
    folded = facing.folded(vertices)
    moved, stopped = _moved(facing, vertices, goal, np.ones(len(vertices), dtype=bool), folded)
    if not stopped.any():
        return goal
    for _ in range(PARTIAL_MOVES):
        moved, _ = _moved(facing, moved, moved + PARTIAL_SHARE * (goal - moved), stopped, folded)
    return moved


def _moved(facing: Facing, vertices: np.ndarray, goal: np.ndarray, chosen: np.ndarray, folded: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Chosen vertices at their goals except for those of new folds, which stay; and the (R,) bool that stay.

    Those that stay may fold their neighbors in turn, which then stay as well: at worst all do.
    """
    moved, changed, stay = np.where(chosen[:, None], goal, vertices), chosen, np.zeros(len(vertices), dtype=bool)
    while len(corners := facing.newly_folded_corners(moved, changed, folded)):  # V rounds at most
        changed = np.zeros(len(vertices), dtype=bool)
        changed[corners] = chosen[corners] & ~stay[corners]
        stay |= changed
        moved[changed] = vertices[changed]
    return moved, stay
