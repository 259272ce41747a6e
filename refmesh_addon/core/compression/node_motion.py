"""The motion of control nodes as few shapes over time, each node predicted from earlier ones near it."""

from __future__ import annotations

import numpy as np

from .coder import FRACTION, Coder
from .quantization import Step, coded, expectation
from .skinning import ROTATION_BITS, NodeMotion
from .temporal_basis import coded_basis, coefficients, courses_above, fitted_basis, over_frames

FIRST = 8  # nodes that nothing predicts; every further batch is as large as all before it
NEAREST = 3  # earlier nodes that predict one
FIRST_EXPECTED = 16 * FRACTION  # magnitude for the first nodes
PARAMETER_BITS = 16  # binary digits of rotation parameters


def rotation_parameters(rotations: np.ndarray) -> np.ndarray:
    """(..., 3) modified Rodrigues parameters: the axis times the tangent of a quarter of the angle, at most 1 long."""
    from scipy.spatial.transform import Rotation

    shape = rotations.shape[:-2]
    return Rotation.from_matrix(rotations.reshape(-1, 3, 3)).as_mrp().reshape(*shape, 3)


def rotation_matrices(parameters: np.ndarray) -> np.ndarray:
    """(..., 3, 3) integers in 2^-ROTATION_BITS.  parameters : (..., 3) integers in 2^-PARAMETER_BITS."""
    x, y, z = np.moveaxis(parameters / float(1 << PARAMETER_BITS), -1, 0)
    square = x * x
    square += y * y
    square += z * z
    scale = float(1 << ROTATION_BITS) / ((1.0 + square) * (1.0 + square))
    turn = 4.0 * (1.0 - square)
    rows = [
        [_even(square, y, z), 8.0 * (x * y) - turn * z, 8.0 * (x * z) + turn * y],
        [8.0 * (x * y) + turn * z, _even(square, x, z), 8.0 * (y * z) - turn * x],
        [8.0 * (x * z) - turn * y, 8.0 * (y * z) + turn * x, _even(square, x, y)],
    ]
    return np.rint(np.stack([np.stack([entry * scale for entry in row], axis=-1) for row in rows], axis=-2))


def _even(square: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(1 + s)^2 - 8 (a^2 + b^2): a diagonal entry before it is scaled."""
    total = first * first
    total += second * second
    return (1.0 + square) * (1.0 + square) - 8.0 * total


def coded_motion(coder: Coder, places: np.ndarray, frames: int, steps: tuple[int, int], target: NodeMotion | None) -> NodeMotion:
    """The motion as a decoder sees it.

    places : (J, 3) whole positions at rest, grid units.  steps : of rotation parameters, in 2^-PARAMETER_BITS, and of shifts.
    target : rotations (F, J, 3, 3) and shifts, not rounded; None when decoding.
    """
    earlier = _earlier_nodes(places)
    turns = None if target is None else rotation_parameters(target.rotations) * (1 << PARAMETER_BITS)
    parameters = _coded_courses(coder, earlier, frames, steps[0], turns)
    shifts = _coded_courses(coder, earlier, frames, steps[1], None if target is None else target.shifts)
    return NodeMotion(rotation_matrices(parameters), shifts)


def _coded_courses(coder: Coder, earlier: list, frames: int, step: int, target: np.ndarray | None) -> np.ndarray:
    """(F, J, 3) whole numbers.  target : (F, J, 3), None when decoding."""
    count, basis, goal = sum(len(batch) for batch, _ in earlier), None, None
    if target is not None:
        flat = target.reshape(frames, -1)
        basis = fitted_basis(flat)
        basis = basis[:, : courses_above(coefficients(basis, flat), step / 2)]
        goal = coefficients(basis, flat).reshape(basis.shape[1], count, 3).transpose(1, 0, 2)
    basis = coded_basis(coder, basis, frames)
    values = _coded_coefficients(coder, earlier, Step(np.full(3, float(step))), basis.shape[1], goal)
    return over_frames(basis, values.transpose(1, 0, 2).reshape(basis.shape[1], count * 3)).reshape(frames, count, 3)


def _coded_coefficients(coder: Coder, earlier: list, step: Step, channels: int, goal: np.ndarray | None) -> np.ndarray:
    """(J, K, 3) whole coefficients.  goal : (J, K, 3), None when decoding."""
    count = sum(len(batch) for batch, _ in earlier)
    values, magnitudes = np.zeros((count, channels, 3)), np.zeros((count, channels, 3), dtype=np.int64)
    for batch, near in earlier:
        for channel in range(channels):
            ring, predicted = np.full((len(batch), 3), FIRST_EXPECTED), np.zeros((len(batch), 3))
            if near.shape[1]:
                ring = magnitudes[near, channel].sum(axis=1) * FRACTION // near.shape[1]
                predicted = np.rint(values[near, channel].sum(axis=1) / near.shape[1])
            before = magnitudes[batch, channel - 1] if channel else np.zeros((len(batch), 3), dtype=np.int64)
            residuals = None if goal is None else goal[batch, channel] - predicted
            integers, change = coded(coder, residuals, expectation(ring, before), step)
            values[batch, channel] = predicted + change
            magnitudes[batch, channel] = np.abs(integers)
    return values


def _earlier_nodes(places: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Batches of nodes, (B,), and the (B, NEAREST) nearest nodes of all batches before; none for the first."""
    count = len(places)
    batches, start = [(np.arange(min(FIRST, count)), np.zeros((min(FIRST, count), 0), dtype=np.int64))], FIRST
    while start < count:  # doubles
        batch = np.arange(start, min(2 * start, count))
        difference = places[batch, None] - places[None, :start]
        square = difference[..., 0] ** 2 + difference[..., 1] ** 2 + difference[..., 2] ** 2
        batches.append((batch, np.argsort(square, axis=1, kind="stable")[:, :NEAREST]))
        start *= 2
    return batches
