"""Multidimensional scaling: points in space whose distances are as near as possible to given ones, by SMACOF (De Leeuw 1977)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.spatial.distance import pdist, squareform

from ..progress import Progress, ignore

CONVERGED = 1e-5  # relative drop of stress per step at which SMACOF stops
MAX_STEPS = 300
MIN_SHARE = 0.01  # of the median distance; nearer pairs get no more weight, or two centers in one place would dominate


def stress(points: np.ndarray, distances: np.ndarray) -> float:
    """The paper's equation (3): root of the share of the squared (C, C) distances that (C, 3) points miss; 0 for a perfect fit."""
    return pooled_stress([points], [distances])


def pooled_stress(points: list[np.ndarray], distances: list[np.ndarray]) -> float:
    """The same over several sets of points, each with the distances within it only."""
    total = sum(np.einsum("ij,ij->", own, own) for own in distances)
    missed = 0.0
    for places, own in zip(points, distances, strict=True):
        misfit = own - squareform(pdist(places))
        missed += np.einsum("ij,ij->", misfit, misfit)
    return float(np.sqrt(missed / total)) if total > 0 else 0.0


def near_weights(distances: np.ndarray) -> np.ndarray:
    """(C, C) weights of pairs by the inverse square of their (C, C) distance; zero on the diagonal, mean 1."""
    least = MIN_SHARE * float(np.median(distances)) or 1.0
    weights = np.maximum(distances, least) ** -2.0
    np.fill_diagonal(weights, 0.0)
    return weights / weights.mean()


def smacof(distances: np.ndarray, start: np.ndarray, progress: Progress = ignore, weights: np.ndarray | None = None) -> np.ndarray:
    """(C, 3) points whose distances approach the given (C, C) ones, by Guttman steps; the weighted stress never rises.

    start : (C, 3) initial points.  weights : (C, C) symmetric, positive off the diagonal; None weights all pairs equally.
    """
    points = start - start.mean(axis=0)
    solve = _laplacian_solver(len(points), weights)
    last = np.inf
    for step in range(MAX_STEPS):
        current = squareform(pdist(points))
        misfit = _root_sum(distances - current, weights)
        if misfit >= last * (1 - CONVERGED):
            break
        last = misfit
        ratio = np.divide(distances, current, out=np.zeros_like(distances), where=current > 0)
        if weights is not None:
            ratio *= weights
        points = solve(ratio.sum(axis=1)[:, None] * points - ratio @ points)
        progress((step + 1) / MAX_STEPS)
    progress(1.0)
    return points


def _root_sum(misfit: np.ndarray, weights: np.ndarray | None) -> float:
    return float(np.sqrt(np.einsum("ij,ij->", misfit, misfit) if weights is None else np.einsum("ij,ij,ij->", weights, misfit, misfit)))


def _laplacian_solver(count: int, weights: np.ndarray | None) -> Callable[[np.ndarray], np.ndarray]:
    """The inverse of the weights' Laplacian on vectors that sum to zero."""
    if weights is None:
        return lambda right: right / count
    factor = cho_factor(np.diag(weights.sum(axis=1)) - weights + 1.0 / count)
    return lambda right: cho_solve(factor, right)
