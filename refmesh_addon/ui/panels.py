"""The RefMesh tab of the sidebar: its panels in their order."""

import bpy

from .bodies_panel import REFMESH_PT_bodies
from .centers_panel import REFMESH_PT_centers
from .corrections_panel import REFMESH_PT_corrections, REFMESH_UL_corrections
from .export_panel import REFMESH_MT_export, REFMESH_PT_export
from .groups_panel import REFMESH_PT_groups, REFMESH_UL_groups
from .run_panel import REFMESH_PT_run
from .sequence_panel import REFMESH_PT_sequence, REFMESH_UL_findings
from .step_panels import REFMESH_PT_color, REFMESH_PT_deform, REFMESH_PT_reference, REFMESH_PT_track, REFMESH_UL_places
from .step_settings import REFMESH_PT_deform_advanced, REFMESH_PT_reference_advanced, REFMESH_PT_track_advanced
from .view_panel import REFMESH_PT_view

CLASSES = (
    REFMESH_PT_run,
    REFMESH_PT_view,
    REFMESH_UL_findings,
    REFMESH_PT_sequence,
    REFMESH_PT_track,
    REFMESH_PT_track_advanced,
    REFMESH_PT_centers,
    REFMESH_PT_reference,
    REFMESH_PT_reference_advanced,
    REFMESH_UL_groups,
    REFMESH_PT_groups,
    REFMESH_PT_bodies,
    REFMESH_UL_places,
    REFMESH_PT_deform,
    REFMESH_PT_deform_advanced,
    REFMESH_UL_corrections,
    REFMESH_PT_corrections,
    REFMESH_PT_color,
    REFMESH_MT_export,
    REFMESH_PT_export,
)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
