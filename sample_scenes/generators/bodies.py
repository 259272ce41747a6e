"""Bodies made of moving parts, and the sequence of frames they give."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from refmesh_addon.core.types import TriangleMesh

from .motions import Chain, Motion
from .shapes import Field, union
from .surface import iso_surface


@dataclass(frozen=True)
class Part:
    """A solid at rest and the motion that carries it."""

    solid: Field
    motion: Motion = Chain(())


@dataclass(frozen=True)
class Body:
    """One connected thing made of parts; it is there from time `start` on."""

    parts: tuple[Part, ...]
    start: float = 0.0

    def part_of(self, rest_points: np.ndarray) -> np.ndarray:
        """Index (N,) of the part that each rest point lies deepest in."""
        return np.argmin([part.solid(rest_points) for part in self.parts], axis=0)

    def distance(self, points: np.ndarray, time: float) -> np.ndarray:
        """Signed value (N,), negative inside the body as it is at that time; zero on its surface."""
        return np.min([part.solid(part.motion.inverse(points, time)) for part in self.parts], axis=0)

    def forward(self, rest_points: np.ndarray, time: float) -> np.ndarray:
        """Where rest points (N, 3) of this body are at that time."""
        part_of = self.part_of(rest_points)
        return _by_group(rest_points, part_of, [lambda p, m=part.motion: m.forward(p, time) for part in self.parts])

    def inverse(self, points: np.ndarray, time: float) -> np.ndarray:
        """Rest points (N, 3) of points that lie in this body at that time."""
        depth = [part.solid(part.motion.inverse(points, time)) for part in self.parts]
        return _by_group(points, np.argmin(depth, axis=0), [lambda p, m=part.motion: m.inverse(p, time) for part in self.parts])


@dataclass(frozen=True)
class Sequence:
    """Bodies in motion inside the sphere of radius `reach` about `center`; `cell` is the edge length of the meshes."""

    name: str
    bodies: tuple[Body, ...]
    center: tuple[float, float, float]
    reach: float
    cell: float

    def frame(self, time: float, seed: int) -> TriangleMesh:
        """The surface of everything there at that time, 0 to 1; bodies that overlap share one surface. Each seed meshes it differently."""
        present = [body for body in self.bodies if body.start <= time]
        solid = union(*[lambda points, body=body: body.distance(points, time) for body in present])
        return iso_surface(solid, np.asarray(self.center), self.reach, self.cell, np.random.default_rng(seed))

    def frames(self, count: int, first_seed: int = 0) -> list[TriangleMesh]:
        """`count` frames at times 0 to 1, each with a seed and vertices of its own."""
        return [self.frame(time, seed) for seed, time in enumerate(np.linspace(0.0, 1.0, count), first_seed)]

    def labels(self, points: np.ndarray, time: float) -> np.ndarray:
        """Body (N,) that each point lies deepest in at that time."""
        return np.argmin([body.distance(points, time) for body in self.bodies], axis=0)

    def motion(self, rest_points: np.ndarray, labels: np.ndarray, time: float) -> np.ndarray:
        """Where rest points (N, 3) of the bodies `labels` (N,) are at that time."""
        return _by_group(rest_points, labels, [lambda p, b=body: b.forward(p, time) for body in self.bodies])

    def rest(self, points: np.ndarray, labels: np.ndarray, time: float) -> np.ndarray:
        """Rest points (N, 3) of points that lie in the bodies `labels` (N,) at that time: undoes `motion`."""
        return _by_group(points, labels, [lambda p, b=body: b.inverse(p, time) for body in self.bodies])


def _by_group(points: np.ndarray, group: np.ndarray, maps: list) -> np.ndarray:
    moved = np.empty_like(points, dtype=float)
    for index, apply in enumerate(maps):
        chosen = group == index
        moved[chosen] = apply(points[chosen])
    return moved
