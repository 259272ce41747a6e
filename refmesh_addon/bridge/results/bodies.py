"""Bodies to be separated, marked by selected centers; the colors of the centers show which body each belongs to."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np

from ...core.errors import RefMeshError
from ...core.reference.marks import Marks, marks_as_text, parse_marks
from ...io.result_arrays import read_centers
from ..scene.paths import absolute_path
from ..sequence.raw_sequence import frame_at
from .center_colors import set_attributes
from .centers import deselect_centers, selected_centers


def mark_body(owner: bpy.types.Object, body: int | None, scene_frame: int) -> int:
    """Makes the selected centers marks of `body`, counted from 0, None for a new one, and of no other. Returns the number of bodies.

    scene_frame : where new marks are set; earlier ones keep their frame. Raises RefMeshError when no center is selected, or when the
    tracked centers are missing or do not fit.
    """
    state = owner.refmesh
    chosen = selected_centers(state.centers)
    if not len(chosen):
        raise RefMeshError("no centers are selected: select some of one body in edit mode of the centers object")
    frames, positions = _tracked(owner)
    marks = parse_marks(state.settings.apart)
    number = marks.frame if marks else int(frame_at(owner, scene_frame).name)
    if number not in frames:
        raise RefMeshError(f"frame {number} is not tracked: go to another frame, or remove the bodies that were marked there")
    centers = positions[frames.index(number)]
    seeds = [np.setdiff1d(members, chosen) for members in _seeds(owner, centers, marks)]
    if body is None:
        seeds.append(chosen)
    else:
        seeds[body] = np.union1d(seeds[body], chosen)
    _set_marks(owner, number, [centers[members] for members in seeds if len(members)])
    deselect_centers(state.centers)
    return sum(len(members) > 0 for members in seeds)


def forget_body(owner: bpy.types.Object, body: int) -> None:
    """Removes the marks of a body, counted from 0."""
    marks = parse_marks(owner.refmesh.settings.apart)
    _set_marks(owner, marks.frame, [points for index, points in enumerate(marks.bodies) if index != body])


def show_bodies(owner: bpy.types.Object) -> None:
    """Colors the centers by the bodies that the marks divide them into. Raises RefMeshError for marks that contradict each other."""
    from ...core.reference.marked_bodies import bodies_by_marks
    from ...core.tracking.center_attributes import lasting_bodies

    state = owner.refmesh
    frames, positions = _tracked(owner)
    marked = _with_advice(bodies_by_marks, positions, frames, state.center_spacing, parse_marks(state.settings.apart))
    set_attributes(state.centers, {"body": lasting_bodies(positions, state.center_spacing, marked)})
    state.center_color = "BODY"


def _set_marks(owner: bpy.types.Object, frame: int, bodies: list[np.ndarray]) -> None:
    owner.refmesh.settings.apart = marks_as_text(Marks(frame, tuple(bodies))) if bodies else ""
    show_bodies(owner)


def _seeds(owner: bpy.types.Object, centers: np.ndarray, marks: Marks | None) -> list[np.ndarray]:
    """Indices of the centers that mark each body."""
    from ...core.reference.marked_bodies import marked_centers

    return _with_advice(marked_centers, centers, owner.refmesh.center_spacing, marks.bodies) if marks else []


def _with_advice(function: Callable, *arguments):
    """Calls the function; its ValueError becomes an error that says what to do."""
    try:
        return function(*arguments)
    except ValueError as error:
        raise RefMeshError(f"{error}: remove the marked bodies and mark them again") from error


def _tracked(owner: bpy.types.Object) -> tuple[list[int], np.ndarray]:
    """Numbers of the tracked frames and (F, C, 3) centers in them."""
    folder = absolute_path(owner, owner.refmesh.output)
    centers = read_centers(folder)
    if centers["positions"].shape[1] != len(owner.refmesh.centers.data.vertices):
        raise RefMeshError(f"{folder}: its centers are not those of the scene; press Load Results first")
    return centers["frames"].tolist(), centers["positions"]
