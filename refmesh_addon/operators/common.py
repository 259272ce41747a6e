"""What operators share: errors as reports, and the conditions under which they can run."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path

import bpy

from ..bridge.results.missing import linked_note
from ..core.errors import RefMeshError
from ..pipeline.process.packages import import_problem
from ..properties.selection import sequence_object
from ..properties.wording import for_window

NO_SEQUENCE = "select an object of a mesh sequence, or import one with File > Import > Mesh Sequence (RefMesh)"
CHECK_INSTALLATION = ". 'Check Installation' in the preferences of RefMesh names what does not work"
OBJECT_MODE_FIRST = "switch to Object Mode first"
INTERRUPTED = "interrupted: what is finished is kept, and the same command continues from there"


def reporting(execute: Callable) -> Callable:
    """Turns an error that is meant for the user into an ERROR report, which reaches scripts as RuntimeError."""

    @wraps(execute)
    def wrapped(self, context, *more):  # Blender checks the number of named arguments: two, as `execute` has
        try:
            return execute(self, context, *more)
        except RefMeshError as error:
            self.report({"ERROR"}, for_window(str(error)))
        except ImportError as error:
            self.report({"ERROR"}, import_problem(error) + ("" if bpy.app.background else CHECK_INSTALLATION))
        except KeyboardInterrupt:  # Ctrl-C at a script
            self.report({"ERROR"}, INTERRUPTED)
        return {"CANCELLED"}

    return wrapped


class SceneOperator:
    """Changes the scene, so it runs neither in edit mode nor while a job is running."""

    @classmethod
    def poll(cls, context):
        failure = cls.poll_failure(context)
        if failure:
            cls.poll_message_set(failure)
        return not failure

    @classmethod
    def poll_failure(cls, context) -> str:
        """Why the operator cannot run now, and what to do about it; "" when it can."""
        if context.mode != "OBJECT":
            return OBJECT_MODE_FIRST
        return "a RefMesh job is running: wait for it or cancel it" if running_job(context) else ""


class SequenceOperator(SceneOperator):
    """Works on the sequence that `sequence_object` finds."""

    changes_sequence = True  # which the file that it is linked from has to do
    restores_deleted = False  # objects of the sequence, the source among them, before it does anything else

    @classmethod
    def poll_failure(cls, context) -> str:
        owner = sequence_object(context)
        if owner is None:
            return NO_SEQUENCE
        if cls.changes_sequence and linked_note(owner):
            return linked_note(owner)
        if not owner.users_collection and not cls.restores_deleted:
            return "the source was deleted: press 'Load Results', or run a step, to bring it back"
        return super().poll_failure(context)


class CentersOperator(SequenceOperator):
    """Works on the selected centers, also while they are in edit mode."""

    @classmethod
    def poll_failure(cls, context) -> str:
        owner = sequence_object(context)
        if owner is not None and owner.refmesh.centers is None:
            return "there are no centers yet; run the Track step first"
        failure = super().poll_failure(context)
        return "" if failure == OBJECT_MODE_FIRST and context.edit_object == owner.refmesh.centers else failure


@contextmanager
def object_mode(context) -> Iterator[None]:
    """Object mode inside the block, where selections and colors can be read and written; restores the mode afterward."""
    editing = context.mode != "OBJECT"
    if editing:
        bpy.ops.object.mode_set(mode="OBJECT")
    try:
        yield
    finally:
        if editing:
            bpy.ops.object.mode_set(mode="EDIT")


@contextmanager
def wait_cursor(context) -> Iterator[None]:
    """Shows by the mouse cursor that Blender does not respond for a while."""
    window = context.window
    if window is None or bpy.app.background:
        yield
        return
    window.cursor_modal_set("WAIT")
    try:
        yield
    finally:
        window.cursor_modal_restore()


def running_job(context) -> bpy.types.Operator | None:
    """The job operator that is running in any window, if there is one."""
    running = (operator for window in context.window_manager.windows for operator in window.modal_operators)
    return next((operator for operator in running if operator.bl_idname.startswith("REFMESH_OT_")), None)


def absolute(path: str) -> Path:
    """The absolute form of a path as Blender writes it, where "//" is the folder of the saved scene."""
    return Path(os.path.abspath(bpy.path.abspath(path)))


def chosen_output(path: str) -> Path:
    """The absolute form of an output folder. Raises RefMeshError for none, and for one beside a scene that has not been saved."""
    if not path.strip():
        raise RefMeshError("no output folder is chosen; fill in Output")
    if path.startswith("//") and not bpy.data.filepath:
        raise RefMeshError(f"{path}: the output folder is beside the scene: save the scene first, or choose another folder")
    return absolute(path)
