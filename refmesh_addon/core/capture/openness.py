"""Takes without volume: open sheets, and bodies of which one side was captured."""

from __future__ import annotations

import numpy as np

from ..geometry.mesh import triangle_areas
from ..types import TriangleMesh

# Share of the closed surface that caps may be before a frame counts as open: soles and hems stay below a twentieth.
LARGEST_CAPPED = 0.2
# Isoperimetric quotient, 36 pi V^2 / A^3, of 1 for a ball: a standing person has about 0.1, a thin double sheet 0.01 and less.
LEAST_COMPACT = 0.02


def capped_share(mesh: TriangleMesh, closed: TriangleMesh) -> float:
    """Share of the area of a mesh with capped holes that its caps are.

    closed : what `capped` gives for the mesh: its triangles first, then those of the caps.
    """
    areas = triangle_areas(closed)
    return float(areas[len(mesh.triangles) :].sum() / areas.sum())


def compactness(closed: TriangleMesh, volume: float) -> float:
    """Isoperimetric quotient of a closed mesh, 1 for a ball, 0 for a sheet; volume : that it encloses, scene units cubed."""
    return float(36 * np.pi * volume**2 / triangle_areas(closed).sum() ** 3)


def openness(capped_share: float, compactness: float) -> str:
    """Why a frame encloses no volume that could be followed; "" where it does."""
    if capped_share > LARGEST_CAPPED:
        return f"is open: {capped_share:.0%} of its surface is a guess that closes it, and what lies there cannot be followed"
    if compactness < LEAST_COMPACT:
        return "encloses hardly any volume, like a sheet: the method follows volumes, and errors may be large"
    return ""
