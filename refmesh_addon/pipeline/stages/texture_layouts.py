"""The texture layout of each reference mesh: a UV map of the user's, or one that is computed."""

from __future__ import annotations

from collections.abc import Mapping

from ...core.reference.group import ReferenceMesh
from ..session.cache import digest
from ..session.cached_map import WorkUnit, cached_map
from ..session.context import Context
from ..session.stage_share import StageShare
from .color_units import GroupLayout, make_layout
from .own_layout import own_layouts

LAYOUT_SCHEMA = 4


def texture_layouts(context: Context, references: Mapping[int, ReferenceMesh], share: StageShare) -> Mapping[int, GroupLayout]:
    """By index of the group. UV maps of the user's own are kept.  references : as deformed, with transient pieces."""
    units, given = {}, own_layouts(context, references)
    for index, reference in references.items():
        mesh, own = reference.mesh, given.get(index)
        key = digest(LAYOUT_SCHEMA, mesh.vertices.tobytes(), mesh.triangles.tobytes(), own.corners.tobytes() if own else b"")
        units[index] = WorkUnit(f"color/layout_{index:03d}", key, lambda mesh=mesh, own=own: (mesh, own))
    return cached_map(context, make_layout, units, GroupLayout, share)
