"""What kind of surface a capture is: closed bodies, thin closed layers, or open sheets, such as the view of one camera.

Decided from the surface alone, and once for a take: frames near a limit must not be treated in two ways.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from ..geometry.mesh import component_volumes, triangle_areas, vertex_components
from ..types import TriangleMesh

# Share of the closed surface that caps may be before a frame counts as open: soles and hems stay below a twentieth.
LARGEST_CAPPED = 0.2
# Isoperimetric quotient, 36 pi V^2 / A^3, of 1 for a ball: a standing person has about 0.1, a thin double sheet 0.01 and less.
LEAST_COMPACT = 0.02
# The same of connected pieces, in the mean by area, which does not fall with their number: pieces of a layer have 0.03 to 0.06.
LEAST_COMPACT_PIECE = 0.07


def capped_share(mesh: TriangleMesh, closed: TriangleMesh) -> float:
    """Share of the area of a mesh with capped holes that its caps are.

    closed : what `capped` gives for the mesh: its triangles first, then those of the caps.
    """
    areas = triangle_areas(closed)
    return float(areas[len(mesh.triangles) :].sum() / areas.sum())


def compactness(closed: TriangleMesh, volume: float) -> float:
    """Isoperimetric quotient of a closed mesh, 1 for a ball, 0 for a sheet; volume : that it encloses, scene units cubed."""
    return float(36 * np.pi * (volume / triangle_areas(closed).sum() ** 1.5) ** 2)  # lengths to the sixth power would overflow


# From the most to the least complete. A layer is what fusing the depth of one camera leaves: closed, but with a back that nothing showed.
CLOSED, LAYER, OPEN = KINDS = ("closed", "layer", "open")
DESCRIPTIONS = {
    CLOSED: "closed bodies",
    LAYER: "thin closed layers, as fused from the depth of one camera: each is followed as a sheet with two sides",
    OPEN: "open surfaces, as one camera or a phone sees them: a shell behind them is followed, and the result stays open",
}

ADJECTIVES = {CLOSED: "closed", LAYER: "thin layers", OPEN: "open"}

SIDES = {CLOSED: 1, LAYER: 2, OPEN: 1}  # how often a frame has each part of the surface: a layer has a back behind all that was seen


def surface_kind(capped_share: float, compactness: float, of_pieces: float) -> str:
    """One of KINDS for a frame.  compactness, of_pieces : as a whole, and the mean of its connected pieces: many bodies make no layer."""
    if capped_share > LARGEST_CAPPED:
        return OPEN
    return LAYER if compactness < LEAST_COMPACT and of_pieces < LEAST_COMPACT_PIECE else CLOSED


def take_kind(kinds: Sequence[str], requested: str = "auto") -> str:
    """One of KINDS for a whole take: that of most frames, the more complete one where two are as frequent.

    kinds : of its frames.  requested : "auto"; "closed", or "open" for what is not closed in most frames, a layer where it is one.
    """
    if requested == CLOSED:
        return CLOSED
    counts = Counter(kinds)
    usual = max(KINDS, key=lambda kind: counts[kind])
    if requested == OPEN and usual == CLOSED:
        return OPEN
    return usual


def compactness_of_pieces(closed: TriangleMesh) -> float:
    """Isoperimetric quotient of the connected pieces of a closed mesh, in the mean by area."""
    count, label = vertex_components(closed)
    areas = np.bincount(label[closed.triangles[:, 0]], triangle_areas(closed), count)
    volumes, present = component_volumes(closed, label), areas > 0
    return float((36 * np.pi * volumes[present] ** 2 / areas[present] ** 2).sum() / areas.sum())


def openness(capped_share: float, compactness: float) -> str:
    """Why a frame encloses no volume that could be followed; "" where it does."""
    if capped_share > LARGEST_CAPPED:
        return f"is open: {capped_share:.0%} of its surface is a guess that closes it, and what lies there cannot be followed"
    if compactness < LEAST_COMPACT:
        return "encloses hardly any volume, like a sheet: the method follows volumes, and errors may be large"
    return ""
