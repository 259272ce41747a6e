"""Closed-form motions with their inverses.

Each takes rest points (N, 3) and a time from 0 to 1 and has `forward` (rest -> place at that time) and `inverse` (back).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.spatial.transform import Rotation

Curve = Callable[[float], float]  # a number that changes with time
Path = Callable[[float], tuple[float, float, float] | np.ndarray]  # a place that changes with time

STRAIGHT = 1e-9  # times length: a bar bent by less than this angle is taken as straight


class Motion(Protocol):
    """What every motion offers."""

    def forward(self, points: np.ndarray, time: float) -> np.ndarray: ...
    def inverse(self, points: np.ndarray, time: float) -> np.ndarray: ...


@dataclass(frozen=True)
class Rigid:
    """A turn about an axis through the origin by `angle(time)` radians, then a shift by `shift(time)`."""

    axis: tuple[float, float, float]
    angle: Curve
    shift: Path

    def _turn(self, time: float) -> Rotation:
        axis = np.asarray(self.axis, dtype=float)
        return Rotation.from_rotvec(axis / np.linalg.norm(axis) * self.angle(time))

    def forward(self, points, time):
        return self._turn(time).apply(points) + np.asarray(self.shift(time))

    def inverse(self, points, time):
        return self._turn(time).apply(points - np.asarray(self.shift(time)), inverse=True)


@dataclass(frozen=True)
class Squash:
    """z scaled by `factor(time)`, x and y by its inverse square root, so that the volume stays."""

    factor: Curve

    def _scale(self, time: float) -> np.ndarray:
        factor = self.factor(time)
        return np.array([factor**-0.5, factor**-0.5, factor])

    def forward(self, points, time):
        return points * self._scale(time)

    def inverse(self, points, time):
        return points / self._scale(time)


@dataclass(frozen=True)
class Twist:
    """Each section across x turned about the x axis by `rate(time)` radians per unit of x."""

    rate: Curve

    def forward(self, points, time):
        return _turned_about_x(points, self.rate(time) * points[:, 0])

    def inverse(self, points, time):
        return _turned_about_x(points, -self.rate(time) * points[:, 0])


def _turned_about_x(points: np.ndarray, angles: np.ndarray) -> np.ndarray:
    x, y, z = points.T
    return np.column_stack([x, np.cos(angles) * y - np.sin(angles) * z, np.sin(angles) * y + np.cos(angles) * z])


@dataclass(frozen=True)
class Bend:
    """The stretch of x from 0 to `length` rolled toward +z into an arc of `angle(time)` radians (below pi).

    Points with x below 0 stay, points beyond `length` follow rigidly. The line z = 0 keeps its length.
    """

    length: float
    angle: Curve

    def forward(self, points, time):
        angle = self.angle(time)
        if angle < STRAIGHT:
            return points
        radius = self.length / angle
        x, y, z = points.T
        along = np.clip(x, 0.0, self.length)  # where the section sits on the arc
        turn, beyond = along / radius, x - along
        return np.column_stack(
            [np.sin(turn) * (radius - z) + np.cos(turn) * beyond, y, radius - np.cos(turn) * (radius - z) + np.sin(turn) * beyond]
        )

    def inverse(self, points, time):
        angle = self.angle(time)
        if angle < STRAIGHT:
            return points
        radius = self.length / angle
        x, y, z = points.T
        turn = np.clip(np.arctan2(x, radius - z), 0.0, angle)
        # Seen from the center of curvature: the part along the arc's radius and the part across it.
        inward, across = np.sin(turn) * x + np.cos(turn) * (radius - z), np.cos(turn) * x - np.sin(turn) * (radius - z)
        return np.column_stack([turn * radius + across, y, radius - inward])


@dataclass(frozen=True)
class Undo:
    """A motion backwards."""

    motion: Motion

    def forward(self, points, time):
        return self.motion.inverse(points, time)

    def inverse(self, points, time):
        return self.motion.forward(points, time)


@dataclass(frozen=True)
class Chain:
    """One motion after the other; an empty chain stands still."""

    steps: tuple[Motion, ...]

    def forward(self, points, time):
        for step in self.steps:
            points = step.forward(points, time)
        return points

    def inverse(self, points, time):
        for step in reversed(self.steps):
            points = step.inverse(points, time)
        return points
