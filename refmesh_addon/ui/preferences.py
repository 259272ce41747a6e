"""The preferences of the add-on."""

import bpy
from bpy.props import IntProperty, StringProperty

from ..bridge.sequence.raw_sequence import set_memory_budget
from ..pipeline.process.packages import how_to_install, missing_names, missing_packages
from ..properties.preferences import ADDON, preferences
from ..properties.wording import draw_wrapped


class REFMESH_AddonPreferences(bpy.types.AddonPreferences):
    """Memory for playback, who shares the work, and which packages are missing."""

    bl_idname = ADDON

    memory_budget: IntProperty(
        name="Memory Budget",
        description="Megabytes for recently shown frames; with more, more frames play without being read again; with fewer, jobs have more",
        default=512,
        min=16,
        max=1_000_000,
        update=lambda self, context: set_memory_budget(self.memory_budget),
    )

    # Here, not in the scene: a file from elsewhere must not choose where jobs are sent.
    scheduler: StringProperty(
        name="Dask Scheduler",
        description="Address of a Dask scheduler whose workers share the work of jobs, such as tcp://host:8786; empty: this machine alone",
    )

    def draw(self, context):
        self.layout.prop(self, "memory_budget")
        self.layout.prop(self, "scheduler")
        draw_missing(self.layout, context.region.width)
        self.layout.operator("refmesh.check_installation")


def draw_missing(layout, width):
    """Lists missing packages, each with what does not work without it, and says how to get them."""
    for line in missing_packages():
        draw_wrapped(layout, line, width, icon="ERROR")
    if missing_names():
        draw_wrapped(layout, how_to_install(missing_names()), width, icon="INFO")


def register():
    bpy.utils.register_class(REFMESH_AddonPreferences)
    saved = preferences(bpy.context)
    if saved:
        set_memory_budget(saved.memory_budget)


def unregister():
    bpy.utils.unregister_class(REFMESH_AddonPreferences)
