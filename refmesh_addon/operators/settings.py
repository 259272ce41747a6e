"""Presets, and the settings of a job from the arguments of its operator, a preset and the panel."""

import bpy
from bpy.props import EnumProperty

from ..core.presets import EDITS, PRESET_TITLES
from ..core.settings import Settings, flat_fields
from ..pipeline.process.presets import preset_settings, preset_warning
from ..properties.selection import sequence_object
from ..properties.settings import RefMeshSettings, plain_value
from .common import SequenceOperator

PRESET_DESCRIPTIONS = {
    "draft": "Few centers and coarse voxels, for a first look in seconds rather than minutes",
    "standard": "Good for most captures",
    "paper": "The published method: radial basis functions, PyMeshLab's reconstruction where installed, unlimited search, no surface fit",
}


def preset_property(**options):
    """The argument of an operator that chooses a preset."""
    items = [(name, label, PRESET_DESCRIPTIONS[name]) for name, label in PRESET_TITLES.items()]
    return EnumProperty(name="Preset", description="Settings to start from", items=items, default="standard", **options)


def chosen_settings(arguments: bpy.types.OperatorProperties, panel: RefMeshSettings) -> Settings:
    """Values passed to the operator win over a preset passed to it, which wins over the panel.

    Raises RefMeshError, naming the setting, for a value out of range.
    """
    base = with_preset(panel, arguments.preset) if arguments.is_property_set("preset") else panel.to_flat()
    passed = {setting.name: plain_value(arguments, setting.name) for setting in flat_fields() if arguments.is_property_set(setting.name)}
    return Settings.from_flat({**base, **passed})


def with_preset(panel: RefMeshSettings, preset: str) -> dict[str, object]:
    """All settings of a preset, with the edits that the user made for this sequence."""
    return preset_settings(preset).to_flat() | {name: plain_value(panel, name) for name in EDITS}


def settings_warnings(arguments: bpy.types.OperatorProperties) -> tuple[str, ...]:
    """What the preset passed to the operator has to do without, where the operator is not told how."""
    replaced = arguments.is_property_set("reconstruction") or not arguments.is_property_set("preset")
    warning = "" if replaced else preset_warning(arguments.preset)
    return (warning,) if warning else ()


class REFMESH_OT_apply_preset(SequenceOperator, bpy.types.Operator):
    """Set all settings of the sequence to a preset, except where groups begin and which bodies are marked"""

    bl_idname = "refmesh.apply_preset"
    bl_label = "Apply Preset"
    bl_options = {"UNDO"}

    preset: preset_property()

    @classmethod
    def description(cls, context, properties):
        return PRESET_DESCRIPTIONS[properties.preset]

    def execute(self, context):
        settings = sequence_object(context).refmesh.settings
        settings.assign(with_preset(settings, self.preset))
        if warning := preset_warning(self.preset):
            self.report({"WARNING"}, warning)
        return {"FINISHED"}


CLASSES = (REFMESH_OT_apply_preset,)
