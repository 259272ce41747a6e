"""A captured frame made fit for the method: seams closed, oriented outward; and what was wrong with it."""

from __future__ import annotations

from dataclasses import dataclass

from ..geometry.borders import boundary_edges
from ..geometry.holes import capped
from ..geometry.mesh import merged, signed_volume, triangle_areas
from ..types import TriangleMesh
from .openness import capped_share, compactness
from .orientation import flipped_patches, inside_out_bodies, reoriented
from .seams import stitched


@dataclass(frozen=True)
class MeshStatistics:
    """vertices : of the mesh as it came.  diagonal : of the bounding box, scene units.
    volume : enclosed with holes capped, scene units cubed.  open_edges : edges with a triangle on one side only.
    inward : share of the area that faced inward.  capped : share of the closed surface that caps holes.
    compactness : of the closed surface, see `openness`.
    """

    vertices: int
    diagonal: float
    volume: float
    open_edges: int
    inward: float
    capped: float
    compactness: float


@dataclass(frozen=True)
class CapturedFrame:
    """mesh : seams closed, oriented outward.  inside_out : whether a body was inside out.  statistics : of the mesh as it came."""

    mesh: TriangleMesh
    inside_out: bool
    statistics: MeshStatistics


def cleaned(mesh: TriangleMesh) -> CapturedFrame:
    """A mesh as it came from a file, cleaned. Floaters and holes are left."""
    whole = stitched(merged(mesh)[0])
    patches = flipped_patches(whole)
    consistent = reoriented(whole, patches)
    bodies = inside_out_bodies(consistent)
    outward = reoriented(consistent, bodies)
    areas, closed = triangle_areas(whole), capped(outward)
    volume = signed_volume(closed)
    statistics = MeshStatistics(
        vertices=len(mesh.vertices),
        diagonal=whole.diagonal,
        volume=volume,
        open_edges=len(boundary_edges(consistent)),
        inward=float(areas[patches ^ bodies].sum() / areas.sum()),
        capped=capped_share(outward, closed),
        compactness=compactness(closed, volume),
    )
    return CapturedFrame(outward, bool(bodies.any()), statistics)
