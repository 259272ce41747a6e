"""Showing results piece by piece, so that the window stays alive; files are read in a thread meanwhile."""

import time
from concurrent.futures import ThreadPoolExecutor

import bpy

from ..core.errors import RefMeshError
from .common import SequenceOperator, absolute, reporting
from .modal import ModalOperator

SHOWING = 0.02  # seconds that showing results may hold the window at a time


class ShowingOperator(ModalOperator, SequenceOperator):
    """Shows in the scene what is in an output folder: at once in background mode, else in a modal operator that was started."""

    _parts = None  # pieces of work still to be done, once there are any

    def remember_sequence(self, owner):
        """An undo in between makes new Python objects of everything, so the sequence is looked up anew each time."""
        self._owner = owner.session_uid

    def sequence(self):
        """The sequence object. Raises RefMeshError when it is gone."""
        owner = next((candidate for candidate in bpy.data.objects if candidate.session_uid == self._owner), None)
        if owner is None:
            raise RefMeshError("the mesh sequence is gone from the scene; its results are in the output folder")
        return owner

    def results_folder(self):
        """Where the results are."""
        return absolute(self.sequence().refmesh.output)

    def parts(self):
        """Pieces of work that show what is there; each is called with the sequence object; None means wait."""
        from ..bridge.results.loading import known_frames, parts, read_results

        with ThreadPoolExecutor(1) as thread:
            reading = thread.submit(read_results, self.results_folder(), known_frames(self.sequence()))
            while not bpy.app.background and not reading.done():
                yield None
            results = reading.result()
        yield from parts(results)

    def show_all(self):
        """All pieces, one after the other."""
        for part in self.parts():
            if part is not None:
                part(self.sequence())
        return {"FINISHED"}

    def start_showing(self, context):
        """From now on `show_some` is to be called at every tick of the timer."""
        self._parts = self.parts()
        self.show_status(context, "showing results", hint="")
        return {"PASS_THROUGH"}

    @reporting
    def show_some(self, context):
        """As many pieces as fit in a moment; ends the operator with the last."""
        until = time.monotonic() + SHOWING
        try:
            for part in self._parts:
                if part is not None:
                    part(self.sequence())
                if part is None or time.monotonic() > until:
                    return {"PASS_THROUGH"}
        except BaseException:
            self.end_modal(context)
            raise
        self.end_modal(context)
        return {"FINISHED"}
