"""Rounding by rate and distortion: to the integers of the least squared error plus the worth of their bits.

A base shape and its morph targets are rounded one after the other, and each vertex after the one before it, from which it will be coded
as a difference. What counts is the distance along the normals of the frames: along the surface a vertex may take the integer whose
difference has fewer bits. What rounding one shape costs is made up for by the following ones where it can be.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from ..geometry.vectors import TINY

BIT = 0.015  # squared steps of mean error along normals that a bit is worth; measured: more of it loses more than a coarser step does
ALONG = 0.1  # of the squared displacement along the surface that counts, or vertices would drift
NONZERO = 0.5  # bits that a difference takes beyond the logarithm of its size, unless it is 0
CHAIN = 64  # vertices that are rounded one after another; all chains at once, as if each began with the exact end of the one before
NEIGHBORS = np.array(list(product((-1.0, 0.0, 1.0), repeat=3)))  # integers around the best one


def rate_distortion_rounded(shapes: np.ndarray, weights: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(K, V, 3) whole numbers in float64 for the shapes whose weighted sums are the frames.

    shapes : (K, V, 3) in steps, vertices in the order in which they are coded.  weights : (F, K).  normals : (F, V, 3) unit vectors.
    """
    result = np.empty(shapes.shape)
    missed = np.zeros(normals.shape[:2])  # along the normals of each frame, by the shapes so far, steps
    drift = np.zeros(normals.shape)
    for index, shape in enumerate(shapes):
        own = weights[:, index]
        weighted = (own[:, None, None] * normals).transpose(1, 2, 0)
        metric = weighted @ weighted.transpose(0, 2, 1) / len(own)
        metric += max(ALONG * float(np.mean(own**2)), float(TINY)) * np.eye(3)
        pull = np.einsum("vaf,fv->va", weighted, missed) + ALONG * np.tensordot(own, drift, axes=1)
        best = shape - np.linalg.solve(metric, pull[:, :, None] / len(own))[:, :, 0]
        result[index] = _rounded(best, metric)
        moved = result[index] - shape
        missed += own[:, None] * np.einsum("va,fva->fv", moved, normals)
        drift += own[:, None, None] * moved
    return result


def _rounded(best: np.ndarray, metric: np.ndarray) -> np.ndarray:
    """(V, 3) whole numbers of the least squared error by (V, 3, 3) metrics plus the worth of their bits."""
    count = len(best)
    chains = -(-count // CHAIN)
    padded = np.concatenate([best, np.repeat(best[-1:], chains * CHAIN - count, axis=0)]).reshape(chains, CHAIN, 3)
    metrics = np.concatenate([metric, np.repeat(metric[-1:], chains * CHAIN - count, axis=0)]).reshape(chains, CHAIN, 3, 3)
    nearest = np.rint(padded)
    result = np.empty(padded.shape)
    before = np.vstack([np.zeros((1, 3)), nearest[:-1, -1]])
    for place in range(CHAIN):
        candidates = nearest[:, place, None] + NEIGHBORS
        errors = candidates - padded[:, place, None]
        costs = ((errors @ metrics[:, place]) * errors).sum(axis=2)
        differences = np.abs(candidates - before[:, None])
        costs += BIT * (np.log2(1.0 + 2.0 * differences) + NONZERO * (differences > 0)).sum(axis=2)
        before = candidates[np.arange(chains), costs.argmin(axis=1)]
        result[:, place] = before
    return result.reshape(-1, 3)[:count]
