"""A whole session in a Blender with a window, by operators and events; run by test_session.py, or by hand:

    blender --factory-startup --enable-event-simulate -P tests/gui/session.py -- FRAMES OUTPUT [ZIP]

Imports FRAMES through the file browser, runs, cancels with Esc, undoes, saves, opens again, exports and quits while a job
runs. Writes OUTPUT/session.json, with what it saw and how long our code held the window, and pictures where ImageMagick's
`import` is there. Without a ZIP to install, the add-on of this checkout is registered.
"""

from __future__ import annotations

import faulthandler
import json
import shutil
import subprocess
import sys
import time
import traceback
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))  # Blender runs this file by its path
from stopwatch import held, measure_ours, troubles
from window import job, owner, press, view

GIVEN, OUTPUT, *ZIP = (Path(argument) for argument in sys.argv[sys.argv.index("--") + 1 :])
FRAMES = OUTPUT / "frames"  # a copy of what was given, which moves with the scene
TINY = {"segments": "groups", "group_size": 4, "centers": 200, "resolution": 64, "triangles": 2000}
TINY |= {"alignment_steps": 2, "fit_rounds": 2, "samples": 1000}
# Operators that change the scene, with what they would do something with.
CHANGING = {
    **dict.fromkeys(("run_all", "track", "extract_reference", "deform", "evaluate", "check_sequence", "load_results"), {}),
    **{"apply_preset": {"preset": "draft"}, "set_timeline": {}, "exclude_frame": {}, "export": {"format": "ply"}, "render_preview": {}},
    **{"import_sequence": {"filepath": str(GIVEN)}, "save_scene": {"filepath": str(OUTPUT / "never.blend")}},
}
PATIENCE = 300.0  # seconds for any one job
PAUSE = 0.3  # seconds in which the window draws what was changed
seen: dict[str, object] = {}


def main() -> None:
    """Starts the session as soon as the window is there."""
    shutil.copytree(GIVEN, FRAMES)
    bpy.context.preferences.view.show_splash = False
    steps = session()

    def tick() -> float | None:
        try:
            return next(steps) or PAUSE
        except StopIteration:
            return None
        except Exception:
            seen["trouble"] = traceback.format_exc()
            finish()
            return None

    bpy.app.timers.register(tick, first_interval=1.0, persistent=True)


def session() -> Iterator[float | None]:
    """The steps; each yield lets the window live for that many seconds."""
    install()
    if seen["lacking"]:
        finish()
        return
    measure_ours()
    for member in list(bpy.data.objects):
        bpy.data.objects.remove(member)
    yield from import_by_file_browser()
    yield from show_tab()
    seen["checked"] = owner().refmesh.checked
    picture("sequence")
    yield from run_and_cancel()
    yield from run_all()
    yield from undo_and_redo()
    yield from mark_bodies()
    yield from save_and_open()
    yield from export()
    yield from quit_while_a_job_runs()


def install() -> None:
    if ZIP:
        bpy.ops.extensions.package_install_files(filepath=str(ZIP[0]), repo="user_default", enable_on_install=True)
    else:
        sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
        import refmesh_addon

        refmesh_addon.register()
    seen["installed"] = "run_all" in dir(bpy.ops.refmesh)
    seen["lacking"] = [name for name in ("numpy", "scipy", "trimesh", "tqdm") if find_spec(name) is None]


def import_by_file_browser() -> Iterator[float | None]:
    with bpy.context.temp_override(**view()):
        bpy.ops.refmesh.import_sequence("INVOKE_DEFAULT", filepath=str(sorted(FRAMES.iterdir())[0]))
    yield 4.0  # the browser reads the folder
    window = bpy.context.window_manager.windows[-1]
    for area in window.screen.areas:
        area.tag_redraw()
    yield 2.0
    picture("import")
    # By the key that a person presses: the operator behind it, called from here, would free the window it was called in.
    press("RET", next(area for area in window.screen.areas if area.type == "FILE_BROWSER"))
    yield from until(lambda: owner() is not None)
    seen["imported"] = [frame.name for frame in owner().refmesh.frames]
    yield from until(lambda: not job())


def show_tab() -> Iterator[float | None]:
    space = view()["area"]
    space.spaces.active.show_region_ui = True
    yield None
    next(region for region in space.regions if region.type == "UI").active_panel_category = "RefMesh"
    with bpy.context.temp_override(**view()):
        bpy.ops.view3d.view_all()
    yield 1.0


def run_and_cancel() -> Iterator[float | None]:
    settings = owner().refmesh.settings
    for name, value in TINY.items():
        setattr(settings, name, value)
    owner().refmesh.output = str(OUTPUT / "results")
    with bpy.context.temp_override(**view()):
        bpy.ops.refmesh.run_all("INVOKE_DEFAULT", centers=1000, resolution=256)
    yield from until(lambda: "tracking" in job().properties.status)
    picture("running")
    seen["status"] = job().properties.status
    seen["allowed_while_running"] = [name for name, arguments in CHANGING.items() if allowed(name, arguments)]
    press("ESC", view()["area"])
    yield 1.0
    seen["runs_on_after_escape_in_the_view"] = job() is not None
    pressed = time.monotonic()
    press("ESC", next(region for region in view()["area"].regions if region.type == "UI"))
    yield 0.5
    if job() and job().properties.at_stake:  # on a slow machine the job has run for a minute, and asks
        picture("asking")
        press("RET", view()["area"])
    while job() and time.monotonic() < pressed + PATIENCE:
        yield 0.02
    seen["seconds_to_cancel"] = time.monotonic() - pressed
    seen["objects_after_cancel"] = sorted(member.name for member in bpy.data.objects)


def run_all() -> Iterator[float | None]:
    """In a window that draws no 3D view: on a machine without a graphics card that alone takes longer than all of ours."""
    area = view()["area"]
    area.type = "INFO"
    yield 1.0
    end = time.monotonic() + 3.0
    yield from ticks("idle", lambda: time.monotonic() < end)
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=area, region=area.regions[-1]):
        bpy.ops.refmesh.run_all("INVOKE_DEFAULT", **TINY)
    yield from ticks("job", lambda: job() and job().properties.status != "showing results")
    yield from ticks("showing", job)
    area.type = "VIEW_3D"
    yield from show_tab()
    seen["done"] = sorted(owner().refmesh.done)
    picture("results")


def ticks(name: str, going) -> Iterator[float | None]:
    """Notes the longest times between two ticks of a timer, in milliseconds: by the clock, and what this thread worked of it.

    By the clock other programs count too, which may have taken the processor.
    """
    clocks = {"": time.perf_counter, "_worked": time.thread_time}
    last = {kind: clock() for kind, clock in clocks.items()}
    gaps: dict[str, list[float]] = {kind: [] for kind in clocks}
    while going():
        yield 0.001
        for kind, clock in clocks.items():
            now = clock()
            gaps[kind].append(round(1e3 * (now - last[kind]), 1))
            last[kind] = now
    for kind, intervals in gaps.items():
        seen[f"longest_ticks_{name}{kind}"] = sorted(intervals, reverse=True)[:5]


def mark_bodies() -> Iterator[float | None]:
    """Some centers of the ball and of the hand, in edit mode, one after the other."""
    owner().refmesh.show_centers = True
    yield None
    centers = owner().refmesh.centers
    layer = bpy.context.view_layer
    layer.objects.active = centers
    for body in (0, 1):
        for vertex in centers.data.vertices:
            vertex.select = (vertex.co.z > 0) == bool(body) and vertex.index % 3 == 0
        with bpy.context.temp_override(**view()):
            bpy.ops.object.mode_set(mode="EDIT")
        yield 1.0
        picture(f"marking_{body}")
        with bpy.context.temp_override(**view()):
            bpy.ops.refmesh.mark_body("INVOKE_DEFAULT")
            seen["mode_after_marking"] = bpy.context.mode
            bpy.ops.object.mode_set(mode="OBJECT")
    layer.objects.active = owner()
    seen["marked"] = owner().refmesh.settings.apart.count("|") + 1
    view()["area"].spaces.active.shading.type = "MATERIAL"
    yield 8.0  # shaders are compiled
    picture("bodies")
    view()["area"].spaces.active.shading.type = "SOLID"
    for _ in range(2):
        with bpy.context.temp_override(**view()):
            bpy.ops.refmesh.forget_body(body=1)
    yield None


def undo_and_redo() -> Iterator[float | None]:
    names = {member.name for member in bpy.data.objects}
    with bpy.context.temp_override(**view()):
        bpy.ops.ed.undo()
    yield None
    seen["objects_after_undo"] = sorted(member.name for member in bpy.data.objects)
    with bpy.context.temp_override(**view()):
        bpy.ops.ed.redo()
    yield None
    seen["redo_brings_all_back"] = names == {member.name for member in bpy.data.objects}


def save_and_open() -> Iterator[float | None]:
    shot = OUTPUT / "shot" / "scene.blend"
    shot.parent.mkdir()
    bpy.ops.refmesh.save_scene(filepath=str(shot))
    moved = OUTPUT / "moved"
    moved.mkdir()
    for folder in ("frames", "results", "shot"):
        shutil.move(OUTPUT / folder, moved / folder)
    bpy.ops.wm.open_mainfile(filepath=str(moved / "shot" / "scene.blend"), load_ui=False)
    yield 1.0
    state = owner().refmesh
    deformed = state.groups[0].deformed
    seen["reopened"] = {"done": sorted(state.done), "output": state.output, "cache": deformed.modifiers[0].filepath}
    state.show_source = True
    bpy.context.scene.frame_set(bpy.context.scene.frame_end)
    yield None
    seen["shown_after_reopening"] = state.shown


def export() -> Iterator[float | None]:
    with bpy.context.temp_override(**view()):
        bpy.ops.refmesh.export("EXEC_DEFAULT", format="glb", directory=str(OUTPUT / "export"))
    yield None
    seen["exported"] = sorted(path.name for path in (OUTPUT / "export").iterdir())


def quit_while_a_job_runs() -> Iterator[float | None]:
    with bpy.context.temp_override(**view()):
        bpy.ops.refmesh.run_all("INVOKE_DEFAULT", output=str(OUTPUT / "unfinished"), centers=2000, resolution=400)
    yield from until(lambda: job().properties.progress > 0.02)
    seen["lock_at_quit"] = (OUTPUT / "unfinished" / "cache" / "lock").read_text()
    finish()


def finish() -> None:
    seen["held_ms"] = {name: round(1e3 * seconds, 1) for name, seconds in sorted(held.items(), key=lambda item: -item[1])}
    seen["troubles"] = sorted(troubles)
    (OUTPUT / "session.json").write_text(json.dumps(seen, indent=1))
    bpy.ops.wm.quit_blender()


def allowed(name: str, arguments: dict) -> bool:
    """Whether an operator can be called; one that cannot says why."""
    try:
        with bpy.context.temp_override(**view()):
            getattr(bpy.ops.refmesh, name)(**arguments)
    except RuntimeError as error:
        return "a RefMesh job is running: wait for it or cancel it" not in str(error)
    return True


def until(condition) -> Iterator[float | None]:
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError("waited too long")
        yield 0.1


def picture(name: str) -> None:
    if shutil.which("import"):
        subprocess.run(["import", "-window", "root", str(OUTPUT / f"{name}.png")], check=False)


faulthandler.enable()
main()
