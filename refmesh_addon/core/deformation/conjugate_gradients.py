"""Preconditioned conjugate gradients for a few steps (Hestenes & Stiefel 1952; Shewchuk 1994, section B3)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Linear = Callable[[np.ndarray], np.ndarray]  # (N, 3) -> (N, 3)


def conjugate_gradients(product: Linear, precondition: Linear, x: np.ndarray, residual: np.ndarray, steps: int) -> np.ndarray:
    """(N, 3) x after so many steps toward the solution of A x = b.

    product : A times a vector, A symmetric positive definite.  precondition : the inverse of a matrix near A times a vector.
    residual : b - A x at the start. Ends early where the residual is zero.
    """
    direction = precondition(residual)
    size = np.vdot(residual, direction)
    for step in range(steps):
        if not size > 0:
            break
        image = product(direction)
        length = size / np.vdot(direction, image)
        x = x + length * direction
        if step == steps - 1:
            break
        residual = residual - length * image
        preconditioned = precondition(residual)
        previous, size = size, np.vdot(residual, preconditioned)
        direction = preconditioned + (size / previous) * direction
    return x
