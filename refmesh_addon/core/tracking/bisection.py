"""Recursive bisection of a volume into parts of equal mass, across its longest axis: where centers start.

Random places are uneven over long distances too, which relaxation evens out last: what remains of it continues for many
frames of tracking, as a slow flow that no motion of the body explains. Parts of equal mass leave nothing to flow. The cuts
follow the body's principal axes, so a body that is rotated, moved or scaled is cut at the same places.
"""

from __future__ import annotations

import numpy as np

from .volume import VolumeSamples

# A cut perpendicular to the longest axis may lie in a layer of voxels, which rounding would then divide; a slanted one does not.
OBLIQUE = np.array([1.0, 0.0317, 0.0113])
SYMMETRIC = 1e-6  # relative difference below which the two tails count as equal


def equal_parts(samples: VolumeSamples, count: int) -> np.ndarray:
    """Centroids (count, 3) of `count` parts of the volume with about the same mass, in an order that follows the cuts."""
    centroids = np.empty((count, 3))
    pending = [(np.arange(len(samples.masses)), 0, count)]
    while pending:  # the parts of a range are halved, down to one
        chosen, first, parts = pending.pop()
        positions, masses = samples.positions[chosen], samples.masses[chosen]
        centroid = np.average(positions, axis=0, weights=masses)
        if parts == 1 or len(chosen) <= 1:  # fewer samples than centers: they share a place, and Lloyd's steps separate them
            centroids[first : first + parts] = centroid
        else:
            lower = parts // 2
            cut, order = _cut(positions - centroid, masses, lower / parts)
            pending += [(chosen[order[:cut]], first, lower), (chosen[order[cut:]], first + lower, parts - lower)]
    return centroids


def _cut(offsets: np.ndarray, masses: np.ndarray, share: float) -> tuple[int, np.ndarray]:
    """Order (N,) of the samples along the longest axis, and how many of them make up the share of the mass."""
    _, axes = np.linalg.eigh((offsets * masses[:, None]).T @ offsets)
    along = offsets @ np.stack([_directed(axis, offsets, masses) for axis in axes.T[::-1]]).T @ OBLIQUE
    order = np.argsort(along, kind="stable")
    middles = np.cumsum(masses[order]) - masses[order] / 2
    return int(np.clip(np.searchsorted(middles, share * masses.sum()), 1, len(order) - 1)), order


def _directed(axis: np.ndarray, offsets: np.ndarray, masses: np.ndarray) -> np.ndarray:
    """The axis, pointing to the longer tail of the mass; where both tails are equal, so that its largest coordinate is positive."""
    along = offsets @ axis
    cubes = along * along * along  # numpy raises to the third power ten times slower
    tail = masses @ cubes
    if abs(tail) < SYMMETRIC * (masses @ np.abs(cubes)):
        tail = axis[np.argmax(np.abs(axis))]
    return axis if tail >= 0 else -axis
