"""Makes the pictures of the pages in panel/ from the real interface:

    blender --factory-startup -P docs/make_panel_pictures.py -- FRAMES SCRATCH

in a window of 1600 by 1000 on a display where ImageMagick's `import` is. FRAMES is a small sequence, SCRATCH a folder for its results.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

CHECKOUT = Path(__file__).resolve().parents[1]
PLACE = CHECKOUT / "docs" / "panel"
FRAMES, SCRATCH = sys.argv[sys.argv.index("--") + 1 :]
QUICK = {"segments": "groups", "group_size": 3, "centers": 300, "resolution": 64, "triangles": 4000}
QUICK |= {"alignment_steps": 1, "fit_rounds": 1, "samples": 1000}
# Page -> the panels in its picture and its height in pixels.
PAGES = {
    "sequence": ("sequence", 372),
    "track": ("track track_advanced centers", 446),
    "reference": ("reference groups bodies", 676),
    "deform": ("deform", 388),
    "color": ("color", 236),
    "export": ("export", 202),
}


def main() -> None:
    """Starts when the window is there."""
    sys.path.insert(0, str(CHECKOUT))
    import refmesh_addon

    refmesh_addon.register()
    bpy.context.preferences.view.show_splash = False
    steps = pictures()

    def tick() -> float | None:
        try:
            return next(steps) or 0.3
        except StopIteration:
            bpy.ops.wm.quit_blender()
            return None

    bpy.app.timers.register(tick, first_interval=2.0)


def pictures() -> Iterator[float | None]:
    """A checked and solved sequence, then one page after the other; each yield lets the window live for that many seconds."""
    for member in list(bpy.data.objects):
        bpy.data.objects.remove(member)
    with bpy.context.temp_override(**view()):
        bpy.ops.refmesh.import_sequence(filepath=FRAMES)
        bpy.context.active_object.refmesh.output = SCRATCH
    for operator, options in (("check_sequence", {}), ("run_all", QUICK)):
        with bpy.context.temp_override(**view()):
            getattr(bpy.ops.refmesh, operator)("INVOKE_DEFAULT", **options)
        yield 1.0
        while bpy.context.window_manager.windows[0].modal_operators:
            yield 0.5
    owner = bpy.context.active_object
    owner.refmesh.source, owner.refmesh.output = "//frames", "//refmesh_grasp"  # no folder of one machine
    view()["area"].spaces.active.show_region_ui = True
    yield None
    sidebar = next(region for region in view()["area"].regions if region.type == "UI")
    sidebar.active_panel_category = "RefMesh"
    yield 1.0
    panels = [getattr(bpy.types, name) for name in dir(bpy.types) if name.startswith("REFMESH_PT_")]
    for page, (names, height) in PAGES.items():
        owner.refmesh.settings.apart = marks(owner) if page == "reference" else ""
        yield from alone(panels, [cls for cls in panels if cls.__name__.removeprefix("REFMESH_PT_") in names.split()])
        top = bpy.context.window.height - sidebar.y - sidebar.height
        box = f"{sidebar.width}x{height}+{sidebar.x}+{top}"
        few = ["+dither", "-colors", "64", "-depth", "8"]
        target = f"PNG24:{PLACE / page}.png"  # gray pictures would be stored as such in 16 bits, which some programs show as white
        subprocess.run(["import", "-window", "root", "-crop", box, "+repage", *few, target], check=True)


def marks(owner: bpy.types.Object) -> str:
    """Some centers of two bodies, as the page about them shows them marked."""
    places = sorted((vertex.co.x, vertex.co.y, vertex.co.z) for vertex in owner.refmesh.centers.data.vertices)
    bodies = (", ".join(" ".join(map(str, place)) for place in part) for part in (places[:5], places[-4:]))
    return f"{owner.refmesh.frames[0].name}: {' | '.join(bodies)}"


def alone(panels: list[type], kept: list[type]) -> Iterator[float | None]:
    """Only these panels are in the sidebar while it is drawn."""
    for cls in panels:
        if cls.is_registered:
            bpy.utils.unregister_class(cls)
    for cls in sorted(kept, key=lambda cls: bool(getattr(cls, "bl_parent_id", ""))):
        cls.bl_options = set()  # open
        bpy.utils.register_class(cls)
    yield 1.5


def view() -> dict:
    """The 3D view, as `temp_override` takes it."""
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    return {"window": window, "area": area, "region": next(region for region in area.regions if region.type == "WINDOW")}


main()
