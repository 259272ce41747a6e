"""What each frame of an open take shows, on the copies that are exported, in the forms that files can hold.

USD holds the attribute `visibility` of each frame, as the modifier stores it. Alembic, as Blender writes it, holds colors but no other
attributes: there it is a gray color `visibility` of each frame. The morph targets of glTF have no attributes: there it is `_VISIBILITY`,
the share of the frames that show a vertex.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import bpy
import numpy as np

from ...io.ply import read_visibility
from ...io.report import read_report
from ..scene.attributes import Attribute, write_attribute
from ..scene.visibility_nodes import ATTRIBUTE, remove_visibility
from .export import Export
from .frame_changes import at_each_frame

MEAN = f"_{ATTRIBUTE.upper()}"  # glTF's form of names of attributes of one's own


def is_open(export: Export) -> bool:
    """Whether the results say what each frame shows."""
    return any(group.get("visibility") for group in read_report(export.results)["groups"])


@contextmanager
def visibility_colors(export: Export, copies: Mapping[int, bpy.types.Object]) -> Iterator[None]:
    """Inside the block every change of frame gives the copy of its group a gray color of each corner.

    copies : index of group -> its stand-in. Raises RefMeshError for a frame without visibility.
    """
    for copy in copies.values():
        remove_visibility(copy)  # whose attribute has the same name
        copy.data.color_attributes.new(ATTRIBUTE, "BYTE_COLOR", "CORNER")

    def show(frame: dict) -> None:
        if frame["group"] in copies:
            _set_gray(copies[frame["group"]].data, read_visibility(export.results / frame["deformed"]))

    with at_each_frame(export.owner, read_report(export.results)["frames"], show):
        yield


def add_mean_visibility(export: Export, copies: Mapping[int, bpy.types.Object]) -> bool:
    """Gives the copies the attribute `_VISIBILITY`, the mean of all frames of a group; returns whether any has it now.

    A copy whose number of vertices applied modifiers have changed gets none.
    """
    added, frames = False, read_report(export.results)["frames"]
    for index, copy in copies.items() if is_open(export) else ():
        shown = [read_visibility(export.results / frame["deformed"]) for frame in frames if frame["group"] == index]
        if shown and len(shown[0]) == len(copy.data.vertices):
            write_attribute(copy.data, Attribute(MEAN, "POINT", "FLOAT", np.mean(shown, axis=0)[:, None]))
            added = True
    return added


def _set_gray(mesh: bpy.types.Mesh, visibility: np.ndarray) -> None:
    corners = np.empty(len(mesh.loops), dtype=np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    gray = np.repeat(visibility[corners, None], 4, axis=1).astype(np.float32)
    gray[:, 3] = 1.0
    mesh.color_attributes[ATTRIBUTE].data.foreach_set("color", gray.ravel())
    mesh.update()
