"""Operators that show results in the scene, step by step, so that the window stays responsive."""

import time
from concurrent.futures import ThreadPoolExecutor

import bpy

from ..core.errors import RefMeshError
from .common import SequenceOperator, chosen_output, reporting, sequence_object
from .modal import ModalOperator

TIME_SLICE = 0.02  # seconds that updates of the scene may block the window at a time


class ShowingOperator(ModalOperator, SequenceOperator):
    """Shows the contents of an output folder: at once in background mode, else in a modal operator that has been started."""

    _updates = None  # of the scene that remain, once there are any
    _kinds = None  # of objects before a job whose groups are shown while it runs
    _messages = ()  # that the updates returned
    restores_deleted = True

    def take_sequence(self, context):
        """The selected sequence, with all its objects in the scene."""
        from ..bridge.results.restoring import restore_deleted

        owner = sequence_object(context)
        self._messages = tuple(filter(None, [restore_deleted(owner)]))
        return owner

    def remember_sequence(self, owner):
        """Remembers the sequence by its session_uid, since an undo in between replaces all Python objects."""
        self._owner = owner.session_uid

    def sequence(self):
        """The sequence object. Raises RefMeshError when it is gone."""
        owner = next((candidate for candidate in bpy.data.objects if candidate.session_uid == self._owner), None)
        if owner is None:
            raise RefMeshError("the mesh sequence is gone from the scene; its results are in the output folder")
        return owner

    def results_folder(self):
        """The output folder of the results."""
        return chosen_output(self.sequence().refmesh.output)

    def scene_updates(self):
        """Functions of the sequence object that show its results one after the other; None while files are still being read."""
        from ..bridge.results.loading import known_frames, scene_updates
        from ..bridge.results.reading import read_results

        with ThreadPoolExecutor(1) as thread:
            reading = thread.submit(read_results, self.results_folder(), known_frames(self.sequence()))
            while not bpy.app.background and (not reading.done() or self._is_being_edited()):
                yield None
            results = reading.result()
        yield from scene_updates(results, self._kinds)

    def _is_being_edited(self):
        """Whether an object of the sequence is in a mode that holds a copy of its mesh, which would undo what is written now."""
        owner = self.sequence()
        return any(member.mode != "OBJECT" for member in bpy.data.objects if owner in (member, member.refmesh.sequence))

    def show_all(self):
        """Applies all updates at once."""
        for update in self.scene_updates():
            if update is not None:
                self._apply(update)
        self._tell()
        return {"FINISHED"}

    def _apply(self, update):
        message = update(self.sequence())
        if message and message not in self._messages:
            self._messages = (*self._messages, message)

    def _tell(self):
        """Reports what the updates said, in one message."""
        if self._messages:
            self.report({"INFO"}, "; ".join(self._messages))

    def start_showing(self, context):
        """From now on `show_next` is to be called at every tick of the timer."""
        self._updates = self.scene_updates()
        self.show_status(context, "showing results", hint="")
        return {"PASS_THROUGH"}

    @reporting
    def show_next(self, context):
        """Applies as many updates as fit into a time slice; ends the operator after the last one."""
        until = time.monotonic() + TIME_SLICE
        try:
            for update in self._updates:
                if update is not None:
                    self._apply(update)
                if update is None or time.monotonic() > until:
                    return {"PASS_THROUGH"}
        except BaseException:
            self.end_modal(context)
            raise
        self.end_modal(context)
        self._tell()
        return {"FINISHED"}
