"""The settings of the core as Blender properties.

No `from __future__ import annotations` here: Blender reads the annotations as values.
"""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..core.options import label_of, value_label
from ..core.presets import EDITS, PRESETS
from ..core.settings import Settings, flat_fields
from ..pipeline.process.presets import preset_settings

AUTOMATIC = "0 (auto)"  # in the help of a setting; the panel has a button for it


def blender_property(setting, **options):
    """The bpy property that shows one dataclass field of `core.settings`, with its range, choices and help."""
    meta, default = setting.metadata, setting.default
    shared = {"name": label_of(setting), "description": meta["help"], "default": default, **options}
    if meta["choices"] is not None:
        items = [(key, value_label(setting, key), explanation) for key, explanation in meta["choices"].items()]
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


def panel_properties() -> dict:
    """The same for the panel, where a number that may be chosen automatically has a switch `auto_...` beside it."""
    texts = {setting.name: setting.metadata["help"].replace(AUTOMATIC, "Auto") for setting in flat_fields()}
    numbers = {setting.name: blender_property(setting, description=texts[setting.name]) for setting in flat_fields()}
    switches = {f"auto_{item.name}": _switch(item, texts[item.name]) for item in flat_fields() if item.metadata["manual"] is not None}
    return numbers | switches


def _switch(setting, text: str):
    name, manual = setting.name, setting.metadata["manual"]

    def choose(settings, automatic: bool) -> None:
        setattr(settings, name, 0 if automatic else manual)

    return BoolProperty(name="Auto", description=text, get=lambda settings: getattr(settings, name) == 0, set=choose)


def plain_value(holder, name: str) -> object:
    """A property's value; a float as it was typed, since Blender stores 0.01 as 0.0099999998."""
    value = getattr(holder, name)
    return float(f"{value:.6g}") if isinstance(value, float) else value


class RefMeshSettings(bpy.types.PropertyGroup):
    """All settings of the pipeline, generated from the dataclasses of `core.settings`."""

    __annotations__ = panel_properties()

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
