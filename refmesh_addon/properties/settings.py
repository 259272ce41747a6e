"""The settings of the core as Blender properties.

No `from __future__ import annotations` here: Blender reads the annotations as values.
"""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..core.settings import EDITS, PRESETS, Settings, flat_fields
from ..pipeline.process.presets import preset_settings
from .wording import title


def blender_property(setting, **options):
    """The bpy property that shows one dataclass field of `core.settings`, with its range, choices and help."""
    meta, default = setting.metadata, setting.default
    shared = {"name": meta["label"] or title(setting.name), "description": meta["help"], "default": default, **options}
    if meta["choices"] is not None:
        items = [(key, meta["titles"].get(key, title(key)), explanation) for key, explanation in meta["choices"].items()]
        return EnumProperty(items=items, **shared)
    if isinstance(default, bool):
        return BoolProperty(**shared)
    if isinstance(default, str):
        return StringProperty(**shared)
    kind = IntProperty if isinstance(default, int) else FloatProperty
    limits = {key: meta[bound] for key, bound in (("min", "low"), ("max", "high")) if meta[bound] is not None}
    return kind(**shared, **limits)


def setting_properties(**options) -> dict:
    """name -> bpy property for every setting of every stage, for the annotations of a panel's or operator's class."""
    return {setting.name: blender_property(setting, **options) for setting in flat_fields()}


def plain_value(holder, name: str) -> object:
    """A property's value; a float as it was typed, since Blender stores 0.01 as 0.0099999998."""
    value = getattr(holder, name)
    return float(f"{value:.6g}") if isinstance(value, float) else value


class RefMeshSettings(bpy.types.PropertyGroup):
    """All settings of the pipeline, generated from the dataclasses of `core.settings`."""

    __annotations__ = setting_properties()

    def to_flat(self) -> dict[str, object]:
        """name -> value, as `Settings.from_flat` takes it."""
        return {setting.name: plain_value(self, setting.name) for setting in flat_fields()}

    def assign(self, values: dict[str, object]) -> None:
        """Sets each named value."""
        for name, value in values.items():
            setattr(self, name, value)

    def matching_preset(self) -> str:
        """The preset that these settings equal; "" when there is none."""
        current = Settings.from_flat({name: value for name, value in self.to_flat().items() if name not in EDITS})
        return next((name for name in PRESETS if preset_settings(name) == current), "")


CLASSES = (RefMeshSettings,)
