"""Jobs: the pipeline in a worker process, with a responsive window or a progress bar on stderr."""

from dataclasses import replace
from pathlib import Path

import bpy
from bpy.props import BoolProperty, StringProperty

from ..core.errors import RefMeshError
from ..core.settings import STAGES
from ..io.frame_range import format_frames
from ..properties.preferences import preferred_scheduler
from ..properties.settings import setting_properties
from ..properties.wording import for_window
from .arrivals import Arrivals
from .common import absolute, chosen_output, reporting
from .modal import POLL_INTERVAL
from .progress import Clock, progress_bar
from .settings import chosen_settings, preset_property, settings_warnings
from .showing import ShowingOperator

# Arguments apply to one call: without this, Blender would reuse the last ones when the button is pressed again.
ONCE = {"options": {"SKIP_SAVE"}}


class JobOperator(ShowingOperator):
    """Runs the pipeline up to the stage `until`, then shows what it wrote.

    In a window it is modal and can be canceled; in background mode it returns when the job is done.
    """

    bl_options = {"UNDO"}
    until: str
    _worker = None
    __annotations__ = {
        "preset": preset_property(**ONCE),
        "output": StringProperty(name="Output", description="Folder for the results; empty takes the panel's", subtype="DIR_PATH", **ONCE),
        "frames": StringProperty(
            name="Frames", description="Numbers as in the file names, such as 6-10,14; empty takes that of the panel", **ONCE
        ),
        "resume": BoolProperty(name="Resume", description="Reuse what an earlier run left in the output folder", default=True, **ONCE),
        "keep_lock": BoolProperty(
            name="Keep Lock",
            description="Let no other job write to the output folder until this process ends; for scripts that export afterward",
            options={"HIDDEN", "SKIP_SAVE"},
        ),
        "scheduler": StringProperty(
            name="Dask Scheduler",
            description="Address of a Dask scheduler whose workers share the work, such as tcp://host:8786; empty: this machine alone",
            **ONCE,
        ),
        "quiet": BoolProperty(name="Quiet", description="No progress bar on stderr in background mode", **ONCE),
        **setting_properties(**ONCE),
    }

    @reporting
    def execute(self, context):
        from ..bridge.results.freshness import is_up_to_date
        from ..bridge.results.own_layouts import keep_own_layouts
        from ..pipeline.process.client import WorkerProcess
        from ..pipeline.process.lock import keep_lock
        from ..pipeline.session.job import CACHE_FOLDER

        owner = self.take_sequence(context)
        spec = self._spec(owner.refmesh)
        if self.keep_lock:
            keep_lock(Path(spec.output) / CACHE_FOLDER, spec.output)
        other_layouts = self.until == STAGES[-1] and keep_own_layouts(owner, Path(spec.output))
        unchanged = self.resume and not other_layouts and not self._messages
        if unchanged and is_up_to_date(owner, self.until, spec.settings.to_flat(), spec.frames, absolute(spec.output)):
            self.report({"INFO"}, "everything is up to date: nothing was computed, and the scene is as it was")
            return {"FINISHED"}
        self.remember_sequence(owner)
        self._worker = WorkerProcess(spec, low_priority=not bpy.app.background)
        self._remember(owner.refmesh, spec)
        return self._wait() if bpy.app.background else self._start(context)

    def modal(self, context, event):
        if self._updates is not None:
            return self.show_next(context) if event.type == "TIMER" else {"PASS_THROUGH"}
        if self.escaped(context, event):
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if self.cancel_requested:
            self._worker.cancel()
        for message in self._worker.poll():
            if message.is_final:
                return self._finish(context, message)
            self._note(message)
            if message.kind == "group":
                self._arrivals.add(int(message.message))
            self._clock.hear(message)
        self._show_arrived()
        self._show_progress(context)
        return {"PASS_THROUGH"}

    def _show_arrived(self):
        """Shows one group that is done, while the job goes on with the others."""
        from ..bridge.results.arriving import show_group

        if self._is_being_edited():
            return
        arrived = self._arrivals.next()
        if arrived is not None:
            self._messages = (*self._messages, *filter(None, [show_group(self.sequence(), arrived)]))

    def _show_progress(self, context):
        """Between two events of the job too, so that the bar moves however long one piece of work takes."""
        self._clock.move()
        if self._clock.share > 0 and self._clock.describe() != self.status:
            self.progress, self.at_stake = self._clock.share, self._clock.at_stake()
            self.show_status(context, self._clock.describe())

    def cancel(self, context):
        """Called by Blender when it ends the operator: another file is loaded, or Blender quits."""
        if self._worker is not None:
            self._worker.cancel()
            self._arrivals.close()
        self.end_modal(context)

    def _spec(self, state):
        from ..io.discovery import find_sequence
        from ..pipeline.session.job import JobSpec
        from ..pipeline.session.job_input import check_apart

        frames = self.frames or state.frame_selection
        output = chosen_output(self.output or state.output)
        sequence = find_sequence(absolute(state.source), frames)
        check_apart(sequence, output)
        not_imported = [number for number in sequence.numbers if str(number) not in state.frames]
        if not_imported:
            added = format_frames(not_imported, sequence.numbers)
            raise RefMeshError(f"not part of the sequence yet: {added}; press 'Reload Frames', beside Source, or choose other Frames")
        settings, warnings = chosen_settings(self.properties, state.settings), settings_warnings(self.properties)
        if settings.reference.mesh:
            settings = replace(settings, reference=replace(settings.reference, mesh=str(absolute(settings.reference.mesh))))
        scheduler = self.scheduler or preferred_scheduler(bpy.context)
        return JobSpec(
            str(absolute(state.source)), str(output), frames, settings, self.until, self.resume, warnings, scheduler=scheduler
        )

    def _remember(self, state, spec):
        """The panel shows the settings that the job uses."""
        state.settings.assign(spec.settings.to_flat())
        state.frame_selection = spec.frames
        if self.output:
            state.output = spec.output

    def _start(self, context):
        from ..bridge.results.visibility import present_kinds

        self._clock, self._kinds = Clock(), present_kinds(self.sequence())
        self._arrivals = Arrivals(self.results_folder())
        return self.start_modal(context, POLL_INTERVAL)

    def _note(self, event):
        if event.kind == "warning":
            self.report({"WARNING"}, for_window(event.message))

    def _wait(self):
        with progress_bar(self.quiet) as advance:
            try:
                for event in self._worker.events():
                    advance(event)
                    self._note(event)
            finally:
                self._worker.cancel()  # an interrupted script leaves no worker; for one that has ended it does nothing
        if not self._succeeded(event):
            return {"CANCELLED"}
        return self.show_all()

    @reporting
    def _finish(self, context, event):
        """The worker has ended: its results are shown step by step, so that the window stays responsive."""
        self._arrivals.close()
        if event.kind != "done":
            self.end_modal(context)
        if not self._succeeded(event):
            return {"CANCELLED"}
        return self.start_showing(context)

    def _succeeded(self, event) -> bool:
        if event.kind == "failed":
            raise RefMeshError(event.message)
        if event.kind == "canceled":
            self.report({"WARNING"}, "canceled; finished results are kept, and running the step again continues from there")
        return event.kind == "done"
