"""What a person has put on the deformed meshes, in the form in which a file can hold it: materials, colors, vertex groups."""

from __future__ import annotations

from collections.abc import Iterable

import bpy
import numpy as np

from ..results.groups import deformed_material
from ..scene.attributes import Attribute, read_weights, write_attribute


def has_materials(copies: Iterable[bpy.types.Object]) -> bool:
    """Whether a stand-in has another material than the plain one of RefMesh."""
    plain = deformed_material()
    return any(slot.material not in (None, plain) for copy in copies for slot in copy.material_slots)


def groups_to_attributes(copies: Iterable[bpy.types.Object], prefix: str) -> bool:
    """Adds the weights of each vertex group as an attribute of the points: files hold no vertex groups without a skeleton.

    prefix : of the names of the attributes, which Blender does not let be those of the groups. Returns whether there were any.
    """
    added = False
    for copy in copies:
        for group, weights in zip(copy.vertex_groups, read_weights(copy).T):
            name = f"{prefix}{group.name}"
            if name not in copy.data.attributes:
                write_attribute(copy.data, Attribute(name, "POINT", "FLOAT", np.nan_to_num(weights)[:, None]))
                added = True
    return added


def supported(operator: object, **options: object) -> dict[str, object]:
    """Those of the options that the exporter of this Blender has."""
    known = operator.get_rna_type().properties
    return {name: value for name, value in options.items() if name in known}
