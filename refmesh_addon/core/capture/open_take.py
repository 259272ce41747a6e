"""What the frames of a take that is no closed body have in common, and each of them made fit for the method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry.holes import capped
from ..geometry.mesh import submesh
from ..types import TriangleMesh
from .cleaning import MeshStatistics
from .depth_artifacts import Artifacts
from .openness import OPEN, surface_kind
from .shell import THICKNESS, shell_behind


@dataclass(frozen=True)
class OpenTake:
    """kind : LAYER or OPEN.  kinds : of its frames.  turned : of each frame, whether it faces against the others.
    thickness : of the shells behind open surfaces, scene units.
    """

    kind: str
    kinds: tuple[str, ...]
    turned: tuple[bool, ...]
    thickness: float

    def facts_of(self, index: int) -> list[object]:
        """All that `surface` and `body` depend on beside the mesh of a frame."""
        return [self.kind, self.kinds[index], self.turned[index], self.thickness]

    def surface(self, mesh: TriangleMesh, artifacts: Artifacts, index: int) -> TriangleMesh:
        """A frame without what depth cameras add, facing as the others.

        mesh : of the frame with this index, neighbors facing alike.  artifacts : what is left out of it.
        """
        kept = submesh(mesh, ~artifacts.any)[0]
        return TriangleMesh(kept.vertices, kept.triangles[:, ::-1]) if self.turned[index] else kept

    def body(self, surface: TriangleMesh, index: int) -> TriangleMesh:
        """The volume that is followed: what a layer encloses, a shell behind an open surface.  surface : of the frame with this index."""
        return shell_behind(surface, self.thickness) if OPEN in (self.kind, self.kinds[index]) else capped(surface)


def open_take(kind: str, frames: Sequence[tuple[np.ndarray, MeshStatistics]]) -> OpenTake:
    """The common facts of a take of this kind, LAYER or OPEN.  frames : `facing` and `statistics` of each, as `CapturedFrame` has them."""
    kinds = tuple(surface_kind(statistics.capped, statistics.compactness, statistics.of_pieces) for _, statistics in frames)
    thickness = THICKNESS * float(np.sqrt(np.median([statistics.area for _, statistics in frames])))
    turned = _turned([facing for facing, _ in frames]) if kind == OPEN else (False,) * len(frames)
    return OpenTake(kind, kinds, turned, thickness)


def _turned(facing: list[np.ndarray]) -> tuple[bool, ...]:
    """Which frames face against most of the others; a camera that moves turns little from one frame to the next."""
    signs, last = [], facing[0]
    for normal in facing:
        signs.append(-1 if normal @ last < 0 else 1)
        last = signs[-1] * normal
    return tuple(sign != (1 if sum(signs) >= 0 else -1) for sign in signs)
