"""Where the vertices and frames of a vertex animation texture are.

OpenVAT (https://openvat.org): vertices go from left to right, each with its frames below it, from the top down; where a row is full, the
next vertices begin a block of rows below. The second UV set of the mesh names the middle of each vertex's texel of the first frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.errors import RefMeshError

LARGEST = 8192  # texels along a side, which all engines read
LEAST = 64  # texels along a side of a square texture


@dataclass(frozen=True)
class Arrangement:
    """width, height : texels.  vertices, frames : counts.  packed : normals are in the lower half, positions in the upper one."""

    width: int
    height: int
    vertices: int
    frames: int
    packed: bool

    @classmethod
    def square(cls, vertices: int, frames: int) -> Arrangement:
        """The smallest with sides that are powers of two, in nearly a square; normals need a texture of their own.

        Raises RefMeshError where engines could not read it.
        """
        sides = [LEAST << power for power in range((LARGEST // LEAST).bit_length())]
        fitting = [(width, height) for width in sides if (height := _power_of_two(frames * -(-vertices // width))) <= LARGEST]
        if not fitting:
            raise RefMeshError(_too_large(vertices, frames) + ", reduce the triangles or choose fewer frames")
        width, height = min(fitting, key=lambda size: (size[0] * size[1], abs(size[0] - size[1])))
        return cls(width, height, vertices, frames, packed=False)

    @classmethod
    def row(cls, vertices: int, frames: int) -> Arrangement:
        """All vertices in one row for each frame, normals below the positions. Raises RefMeshError where engines could not read it."""
        if vertices > LARGEST or 2 * frames > LARGEST:
            raise RefMeshError(_too_large(vertices, frames) + " in a row each; reduce the triangles or choose fewer frames")
        return cls(vertices, 2 * frames, vertices, frames, packed=True)

    def texels(self) -> tuple[np.ndarray, np.ndarray]:
        """(F, V) rows from the top and (F, V) columns."""
        block, column = np.divmod(np.arange(self.vertices), self.width)
        rows = np.arange(self.frames)[:, None] + block * self.frames
        return rows, np.broadcast_to(column, rows.shape)

    def uvs(self) -> np.ndarray:
        """(V, 2) of the first frame, from the upper left."""
        rows, columns = self.texels()
        return (np.column_stack([columns[0], rows[0]]) + 0.5) / [self.width, self.height]


def _power_of_two(least: int) -> int:
    return max(LEAST, 1 << (least - 1).bit_length())


def _too_large(vertices: int, frames: int) -> str:
    return f"{vertices} vertices and {frames} frames do not fit into a texture of {LARGEST} x {LARGEST}"
