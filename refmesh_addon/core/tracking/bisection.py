"""A volume cut into parts of equal mass, again and again across the longest way through it: where centers start.

Random places are as uneven as chance, over long distances too, and relaxation mends long distances last: what it leaves
goes on for many frames of tracking, as a slow flow that no motion of the body explains. Cuts of equal mass leave
nothing to flow. They follow the body's own axes, so a body that is turned, moved or scaled is cut at the same places.
"""

from __future__ import annotations

import numpy as np

from .volume import VolumeSamples

# A cut square to the longest axis may lie in a layer of voxels, which rounding would then share out; a slanted one does not.
OBLIQUE = np.array([1.0, 0.0317, 0.0113])
SYMMETRIC = 1e-6  # relative difference of the two tails below which they are alike


def equal_parts(samples: VolumeSamples, count: int) -> np.ndarray:
    """Centroids (count, 3) of `count` parts of the volume with about the same mass, in an order that follows the cuts."""
    middles = np.empty((count, 3))
    waiting = [(np.arange(len(samples.masses)), 0, count)]
    while waiting:
        chosen, first, parts = waiting.pop()
        positions, masses = samples.positions[chosen], samples.masses[chosen]
        middle = np.average(positions, axis=0, weights=masses)
        if parts == 1:
            middles[first] = middle
        elif len(chosen) <= 1:  # fewer samples than centers: they share a place, and Lloyd's steps part them
            middles[first : first + parts] = middle
        else:
            lower = parts // 2
            cut, order = _cut(positions - middle, masses, lower / parts)
            waiting += [(chosen[order[:cut]], first, lower), (chosen[order[cut:]], first + lower, parts - lower)]
    return middles


def _cut(offsets: np.ndarray, masses: np.ndarray, share: float) -> tuple[int, np.ndarray]:
    """Order (N,) of the samples along the longest axis, and how many of them make up the share of the mass."""
    _, axes = np.linalg.eigh((offsets * masses[:, None]).T @ offsets)
    along = offsets @ np.stack([_directed(axis, offsets, masses) for axis in axes.T[::-1]]).T @ OBLIQUE
    order = np.argsort(along, kind="stable")
    middles = np.cumsum(masses[order]) - masses[order] / 2
    return int(np.clip(np.searchsorted(middles, share * masses.sum()), 1, len(order) - 1)), order


def _directed(axis: np.ndarray, offsets: np.ndarray, masses: np.ndarray) -> np.ndarray:
    """The axis towards the longer tail of the mass; where both are alike, along its largest coordinate."""
    along = offsets @ axis
    tail = masses @ along**3
    if abs(tail) < SYMMETRIC * (masses @ np.abs(along) ** 3):
        tail = axis[np.argmax(np.abs(axis))]
    return axis if tail >= 0 else -axis
