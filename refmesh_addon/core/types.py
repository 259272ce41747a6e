"""Frozen result types, one for each arrow of the pipeline.

Letters used in every docstring:
F frames, V vertices and T triangles of one input frame, C centers, P mapped points,
R reference vertices, S reference triangles, K key points.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Annotated

import numpy as np


class FrozenArrays:
    """Base of result types: makes every array field of a dataclass read-only, so that nobody changes a result that others read."""

    def __post_init__(self):
        for field in fields(self):  # type: ignore[arg-type]  # only dataclasses derive from this
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                view = value.view()
                view.flags.writeable = False
                object.__setattr__(self, field.name, view)


class Keyed:
    """Base of inputs that many calls share: equal `key`, equal content.

    `latest_only` then builds what depends on such an input once per process, however often it arrives there as another copy.
    """

    key: str

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and other.key == self.key

    def __hash__(self) -> int:
        return hash(self.key)


@dataclass(frozen=True)
class TriangleMesh(FrozenArrays):
    """A triangle mesh.

    vertices : (V, 3) float64, scene units.
    triangles : (T, 3) int32, indices into `vertices`, counter-clockwise seen from outside.
    """

    vertices: Annotated[np.ndarray, "(V, 3) float64"]
    triangles: Annotated[np.ndarray, "(T, 3) int32 < V"]

    def __post_init__(self):
        object.__setattr__(self, "vertices", np.ascontiguousarray(self.vertices, dtype=np.float64))
        object.__setattr__(self, "triangles", np.ascontiguousarray(self.triangles, dtype=np.int32))
        for name in ("vertices", "triangles"):
            shape = getattr(self, name).shape
            if len(shape) != 2 or shape[1] != 3:
                raise ValueError(f"{name} must be (N, 3); got {shape}")
        super().__post_init__()

    @property
    def diagonal(self) -> float:
        """Length of the bounding-box diagonal, scene units."""
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0))) if len(self.vertices) else 0.0

    def moved(self, vertices: np.ndarray) -> TriangleMesh:
        """The same triangles on other vertex positions, (V, 3). Raises ValueError for another number of them."""
        if vertices.shape != self.vertices.shape:
            raise ValueError(f"vertices must be {self.vertices.shape} to keep the topology; got {vertices.shape}")
        return TriangleMesh(vertices, self.triangles)
