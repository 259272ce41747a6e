"""The texture layout of a mesh: xatlas and Blender as far as they are there, a plain projection where they are not."""

from __future__ import annotations

from ...core.color.layout import Layout, LayoutQuality, measured
from ...core.color.projected_layout import projected_layout
from ...core.types import TriangleMesh
from .flattening import flattened
from .unwrapping import unwrapped

XATLAS, XATLAS_ABF, SMART_UV_ABF, PROJECTED = "xatlas", "xatlas_abf", "smart_uv_abf", "projected"


def best_layout(mesh: TriangleMesh) -> tuple[Layout, str]:
    """A layout of the mesh and what made it.

    Blender's angle-based flattening takes the charts of xatlas, or those of Smart UV Project where xatlas is missing, fails or takes too
    long. What gives texels more even and larger is taken; without both, triangles are projected along a few directions.
    """
    charts = unwrapped(mesh)
    flat = flattened(mesh, charts)
    if charts is None:
        return (projected_layout(mesh), PROJECTED) if flat is None else (flat, SMART_UV_ABF)
    better = flat is not None and _resolution(measured(mesh, flat)) > _resolution(measured(mesh, charts))
    return (flat, XATLAS_ABF) if better else (charts, XATLAS)


def _resolution(quality: LayoutQuality) -> float:
    """Texels that the surface gets, less where they are of uneven size."""
    return quality.area_used / quality.stretch
