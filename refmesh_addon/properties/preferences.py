"""What the preferences of the add-on say, for operators."""

import bpy

ADDON = __package__.rpartition(".refmesh_addon")[0] or "refmesh_addon"  # of the extension, or of the package in a checkout


def preferences(context) -> bpy.types.AddonPreferences | None:
    """The preferences of the add-on; None where a script registered it without enabling it."""
    addon = context.preferences.addons.get(ADDON)
    return addon and addon.preferences


def preferred_scheduler(context) -> str:
    """Address of the Dask scheduler that jobs of the panel use, "" for this machine alone; scripts name one themselves."""
    chosen = preferences(context)
    return chosen.scheduler.strip() if chosen and not bpy.app.background else ""
