"""A captured frame made fit for the method: seams closed, oriented outward; and what was wrong with it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ..geometry.borders import boundary_edges
from ..geometry.holes import capped
from ..geometry.mesh import area_vectors, merged, signed_volume, triangle_areas
from ..types import TriangleMesh
from .openness import LARGEST_CAPPED, capped_share, compactness, compactness_of_pieces
from .orientation import flipped_patches, inside_out_bodies, reoriented
from .resolution import needed_triangles
from .rims import rim_excess
from .seams import stitched
from .sheet_orientation import turned_pieces
from .strays import without_strays


@dataclass(frozen=True)
class MeshStatistics:
    """vertices : of the mesh as it came.  diagonal : of the bounding box, scene units.
    volume : enclosed with holes capped, scene units cubed.  open_edges : edges with a triangle on one side only.
    inward : share of the area that faced inward.  capped : share of the closed surface that caps holes.
    compactness, of_pieces : of the closed surface, and the mean of its connected pieces, see `openness`.
    area : of the surface, scene units squared.  needed_triangles : that a mesh of its shape needs, see `resolution`.
    rim_excess : how ragged the rims of its holes are, see `rims`.
    strays : triangles left out because they are far from everything else.  stray_place : (3,) of the first of them, empty without.
    All but `vertices` and `strays` are without these.
    """

    vertices: int
    diagonal: float
    volume: float
    open_edges: int
    inward: float
    capped: float
    compactness: float
    of_pieces: float
    area: float
    needed_triangles: int
    rim_excess: float
    strays: int
    stray_place: tuple[float, ...]


@dataclass(frozen=True)
class CapturedFrame:
    """mesh : seams closed, oriented outward; an open one as most of its area faced in the file.
    inside_out : whether a body was inside out.
    facing : (3,) mean of its normals by area: the side that it is seen from, near zero for what is closed.
    statistics : of the mesh as it came.
    """

    mesh: TriangleMesh
    inside_out: bool
    facing: Annotated[np.ndarray, "(3) float64"]
    statistics: MeshStatistics


def cleaned(mesh: TriangleMesh) -> CapturedFrame:
    """A mesh as it came from a file, cleaned. Floaters and holes are left."""
    joined = merged(mesh)[0]
    kept, strays = without_strays(joined)
    whole = stitched(kept)
    patches = flipped_patches(whole)
    consistent = reoriented(whole, patches)
    is_open = capped_share(consistent, capped(consistent)) > LARGEST_CAPPED
    bodies = turned_pieces(consistent) if is_open else inside_out_bodies(consistent)
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
        of_pieces=compactness_of_pieces(closed),
        area=float(areas.sum()),
        needed_triangles=needed_triangles(outward),
        rim_excess=rim_excess(outward),
        strays=len(strays),
        stray_place=tuple(joined.vertices[joined.triangles[strays[:1]]].mean(axis=1).ravel().tolist()),
    )
    facing = area_vectors(outward).sum(axis=0) / areas.sum()
    return CapturedFrame(outward, bool(bodies.any()) and not is_open, facing, statistics)
