"""What a person chooses of a small GLB, and what is told of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ...core.color.layout import Layout
from ...core.color.projected_layout import projected_layout
from ...core.types import TriangleMesh

EVERY = 1 << 30  # triangles: none is left out


@dataclass(frozen=True)
class SmallGlb:
    """How good and how large.

    error : RMS distance from the frames along normals, share of the bounding-box diagonal.  triangles : numbers that are tried in turn
    as long as they help; the last is taken where none is close enough.  targets : fewest and most morph targets of a run of frames.
    packed : by EXT_meshopt_compression, which Blender reads from 5.2 on.  normals : with the mean normals of each run, so that it
    looks smooth; without them a viewer shades triangles flat.  placement : (4, 4) from scene units to those of the file, which has y up.
    texture : greatest side of a texture, pixels; 0 leaves colors out.  image : ".webp", ".png" or ".jpg".
    unwrap : makes the layout of a reduced mesh.
    """

    error: float = 5e-4
    triangles: tuple[int, ...] = (8000, 11000, 15000, 20000, EVERY)
    targets: tuple[int, int] = (3, 8)
    packed: bool = False
    normals: bool = True
    placement: np.ndarray = field(default_factory=lambda: np.eye(4))
    texture: int = 1024
    image: str = ".webp"
    unwrap: Callable[[TriangleMesh], Layout] = projected_layout


@dataclass(frozen=True)
class WrittenRun:
    """What a run of frames became.  error : RMS, share of the diagonal.  triangles, targets : counts."""

    numbers: tuple[int, ...]
    error: float
    triangles: int
    targets: int
