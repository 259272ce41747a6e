"""Closest rotations and best rigid motions of many neighborhoods at once.

The closest rotation comes from the unit quaternion q that maximizes q^T K q, where the 4x4 matrix K is linear in the
3x3 input (Horn 1987, "Closed-form solution of absolute orientation using unit quaternions"). Its largest eigenvalue is
the largest root of a quartic, found by Newton from above (Theobald 2005), and q is a column of the adjugate of K - root.
Unlike singular value decompositions, this is a fixed sequence of operations on whole arrays, five times as fast.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ..types import FrozenArrays

BLOCK = 8192  # matrices processed at a time: their few dozen temporary arrays then stay in the processor's cache
NEWTON_STEPS = 30  # enough to halve the distance down to roots as close as SEPARATION, then to converge quadratically
CONVERGED = 1e-15  # relative step below which a root has all its digits
# Smallest gap between the two largest roots, relative to the largest, at which the quaternion keeps ten digits.
SEPARATION = 1e-5
# Of equally close rotations (points on a line, a single point) the one nearest to the identity is taken, by adding this share of the
# largest singular value to the diagonal: far below what matters in a measured shape, far above rounding.
NUDGE = 1e-12


@dataclass(frozen=True)
class RigidMotions(FrozenArrays):
    """One rigid motion for each of C neighborhoods: x -> rotation (x - source) + target.

    rotations : (C, 3, 3).  sources, targets : (C, 3) weighted centroids before and after, scene units.
    """

    rotations: np.ndarray
    sources: np.ndarray
    targets: np.ndarray

    def of(self, chosen: np.ndarray) -> RigidMotions:
        """The motions of some neighborhoods, by index."""
        return RigidMotions(self.rotations[chosen], self.sources[chosen], self.targets[chosen])

    def apply(self, points: np.ndarray) -> np.ndarray:
        """Row i of (C, 3) points moved by motion i."""
        return np.einsum("nij,nj->ni", self.rotations, points - self.sources) + self.targets


def rigid_motions(weights: sparse.spmatrix, source: np.ndarray, target: np.ndarray) -> RigidMotions:
    """Motion i carries the neighborhood of i from source to target with the least weighted squared error (Kabsch 1976).

    weights : (N, C) sparse, not negative; entry (i, j) is the weight of point j in neighborhood i.
    source, target : (C, 3) positions before and after, scene units.
    A row without weight gives the identity about the mean of all points. Raises ValueError for shapes that do not match.
    """
    if source.shape != target.shape or source.shape != (weights.shape[1], 3):
        raise ValueError(f"source and target must be ({weights.shape[1]}, 3) to match weights; got {source.shape} and {target.shape}")
    weights = sparse.csr_matrix(weights)
    # Moments about the common mean, so that coordinates far from the origin lose no digits.
    source_mean, target_mean = source.mean(axis=0), target.mean(axis=0)
    before, after = source - source_mean, target - target_mean
    mass = np.asarray(weights.sum(axis=1)).ravel()
    share = sparse.diags(1.0 / np.where(mass > 0, mass, 1.0)) @ weights
    products = (after[:, :, None] * before[:, None, :]).reshape(-1, 9)
    moments = share @ np.hstack([before, after, products])
    sources, targets = moments[:, :3], moments[:, 3:6]
    covariance = moments[:, 6:].reshape(-1, 3, 3) - targets[:, :, None] * sources[:, None, :]
    return RigidMotions(closest_rotations(covariance), sources + source_mean, targets + target_mean)


def closest_rotations(m: np.ndarray) -> np.ndarray:
    """The proper rotation R (det +1) with the largest tr(R^T M), that is, the smallest |R - M|, for each matrix.

    m : (N, 3, 3) float64, any rank; for a covariance sum of (after)(before)^T, R turns before into after.
    Returns (N, 3, 3). Where several rotations are equally close (rank below two, or a reflection whose two smallest
    singular values are equal), the choice among them depends on the matrix only; zero gives the identity.
    """
    m = np.asarray(m, dtype=np.float64)
    if m.ndim != 3 or m.shape[1:] != (3, 3):
        raise ValueError(f"m must be (N, 3, 3); got {m.shape}")
    rotations = np.empty(m.shape)
    for start in range(0, len(m), BLOCK):
        block = m[start : start + BLOCK]
        entries = np.ascontiguousarray(block.reshape(-1, 9).T)
        scale = np.abs(entries).max(axis=0)
        entries /= np.where(scale > 0, scale, 1.0)  # squares and fourth powers then neither overflow nor vanish
        root, slope = _largest_root(entries)
        quaternions, length = _top_quaternions(entries, root)
        out = rotations[start : start + BLOCK]
        out[:] = rotation_matrices(quaternions / np.where(length > 0, length, 1.0))
        ill_conditioned = ~((slope > SEPARATION * root**3) & (length > 0))
        if ill_conditioned.any():
            out[ill_conditioned] = _decomposed(entries.T[ill_conditioned].reshape(-1, 3, 3))
    return rotations


def _largest_root(entries: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Largest eigenvalue of K for each column of (9, N) entries, and the slope of the quartic there (0 for a double root)."""
    a, b, c, d, e, f, g, h, i = entries
    # With singular values s1, s2, s3 the roots are s1+s2+s3, s1-s2-s3, s2-s1-s3, s3-s1-s2 (s3 < 0 for a reflection).
    xx, yy, zz = a * a + d * d + g * g, b * b + e * e + h * h, c * c + f * f + i * i
    xy, xz, yz = a * b + d * e + g * h, a * c + d * f + g * i, b * c + e * f + h * i
    square = xx + yy + zz
    linear = -8.0 * (a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g))
    constant = 2.0 * (xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + xz * xz + yz * yz)) - square * square
    root = np.sqrt(3.0 * square)  # never below s1 + s2 + s3
    falling = np.ones(len(root), dtype=bool)  # each root stops on its own, so that it does not depend on the others in the block
    for _ in range(NEWTON_STEPS):
        slope = 4.0 * root * (root * root - square) + linear
        value = ((root * root - 2.0 * square) * root + linear) * root + constant
        falling &= (slope > 0) & (value > CONVERGED * root * slope)
        if not falling.any():
            break
        root = root - np.divide(value, slope, out=np.zeros_like(root), where=falling)
    return root, 4.0 * root * (root * root - square) + linear


def _top_quaternions(entries: np.ndarray, root: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvector of K for `root`, (4, N) scalar part first, not normalized, and its length (N,).

    The adjugate of K - root is a multiple of q q^T: the column with the largest diagonal entry keeps the most digits.
    """
    a, b, c, d, e, f, g, h, i = entries
    k00, k11, k22, k33 = a + e + i - root, a - e - i - root, e - a - i - root, i - a - e - root
    k01, k02, k03, k12, k13, k23 = h - f, c - g, d - b, b + d, c + g, f + h
    # 2x2 minors of the lower and upper two rows, each used by several cofactors.
    p01, p02, p03 = k02 * k13 - k03 * k12, k02 * k23 - k03 * k22, k02 * k33 - k03 * k23
    p12, p13, p23 = k12 * k23 - k13 * k22, k12 * k33 - k13 * k23, k22 * k33 - k23 * k23
    u01, u02, u03 = k00 * k11 - k01 * k01, k00 * k12 - k02 * k01, k00 * k13 - k03 * k01
    q00, q11 = k11 * p23 - k12 * p13 + k13 * p12, k00 * p23 - k02 * p03 + k03 * p02
    q22, q33 = k33 * u01 - k13 * u03 + k03 * (k01 * k13 - k03 * k11), k22 * u01 - k12 * u02 + k02 * (k01 * k12 - k02 * k11)
    q01, q02 = -(k01 * p23 - k12 * p03 + k13 * p02), k01 * p13 - k11 * p03 + k13 * p01
    q03, q12 = -(k01 * p12 - k11 * p02 + k12 * p01), -(k00 * p13 - k01 * p03 + k03 * p01)
    q13, q23 = k00 * p12 - k01 * p02 + k02 * p01, -(k23 * u01 - k13 * u02 + k03 * (k01 * k12 - k02 * k11))
    columns = np.array([[q00, q01, q02, q03], [q01, q11, q12, q13], [q02, q12, q22, q23], [q03, q13, q23, q33]])
    best = np.argmax(np.abs([q00, q11, q22, q33]), axis=0)
    chosen = columns[best, :, np.arange(len(root))].T
    return chosen, np.sqrt(np.einsum("ij,ij->j", chosen, chosen))


def rotation_matrices(quaternions: np.ndarray) -> np.ndarray:
    """(4, N) unit quaternions, scalar part first and one in each column, as (N, 3, 3) matrices."""
    w, x, y, z = quaternions
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    ).transpose(2, 0, 1)


def _decomposed(m: np.ndarray) -> np.ndarray:
    """Closest rotations of (N, 3, 3) by singular value decomposition, for matrices whose closest rotation is ill-conditioned."""
    largest = np.linalg.norm(m, axis=(1, 2), keepdims=True)
    u, _, vt = np.linalg.svd(m + NUDGE * largest * np.eye(3))
    u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
    return u @ vt
