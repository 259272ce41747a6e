"""The options of file formats as arguments of an operator: `quality` of the format `xyz` is the argument `xyz_quality`."""

from collections.abc import Iterable
from dataclasses import fields

import bpy

from ..io.formats import Format
from ..properties.settings import blender_property, plain_value


def argument_names(known: Format) -> dict[str, str]:
    """Name of each option of a format -> name of the argument."""
    return {setting.name: f"{known.name}_{setting.name}" for setting in fields(known.options)} if known.options else {}


def format_arguments(formats: Iterable[Format], **options) -> dict:
    """name -> bpy property for every option of every format, for the annotations of an operator's class."""
    return {
        f"{known.name}_{setting.name}": blender_property(setting, **options)
        for known in formats
        if known.options
        for setting in fields(known.options)
    }


def chosen_options(arguments: bpy.types.OperatorProperties, known: Format) -> object | None:
    """The options of a format as the operator has them; None for a format without options."""
    values = {name: plain_value(arguments, argument) for name, argument in argument_names(known).items()}
    return known.options(**values) if known.options else None
