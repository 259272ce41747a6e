"""The add-on leaves nothing behind, and what runs without Blender does not ask for it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import bpy

import refmesh_addon
from refmesh_addon.core.settings import flat_fields

from .conftest import needs_bpy_module

ROOT = Path(refmesh_addon.__file__).resolve().parents[1]


def traces() -> dict:
    """Everything in Blender that an add-on could add to."""
    handlers = {name: list(value) for name in dir(bpy.app.handlers) if isinstance(value := getattr(bpy.app.handlers, name), list)}
    configs = bpy.context.window_manager.keyconfigs
    keymaps = {name: len(keymap.keymap_items) for config in configs for name, keymap in config.keymaps.items()}
    return {
        "types": {name for name in dir(bpy.types) if "REFMESH" in name.upper()},
        "operators": set(dir(bpy.ops.refmesh)),
        "object": set(bpy.types.Object.bl_rna.properties.keys()),
        "scene": set(bpy.types.Scene.bl_rna.properties.keys()),
        "window_manager": set(bpy.types.WindowManager.bl_rna.properties.keys()),
        "menu": list(bpy.types.TOPBAR_MT_file_import.draw._draw_funcs),
        "handlers": handlers,
        "keymaps": keymaps,
    }


def test_register_twice_leaves_nothing_behind():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.types.TOPBAR_MT_file_import.append(draw_nothing)  # so that the menu has a list of draw functions from the start
    before = traces()
    for _ in range(2):
        refmesh_addon.register()
        assert traces() != before
        refmesh_addon.unregister()
        assert traces() == before
    bpy.types.TOPBAR_MT_file_import.remove(draw_nothing)


def draw_nothing(self, context):
    pass


def test_core_and_pipeline_do_not_import_bpy():
    code = (
        "import sys; sys.modules['bpy'] = None;"
        "import refmesh_addon.core.settings, refmesh_addon.io.sequence;"
        "import refmesh_addon.pipeline.process.client, refmesh_addon.pipeline.process.worker"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)


@needs_bpy_module
def test_registering_imports_nothing_heavy():
    """A wheel that is missing must not keep the add-on from being enabled."""
    code = (
        "import sys\n"
        "for name in ('scipy', 'trimesh', 'tqdm'): sys.modules[name] = None\n"
        "import bpy, refmesh_addon; refmesh_addon.register(); refmesh_addon.unregister()"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)


def test_every_property_has_a_tooltip(blender):
    unexplained = []
    for name in dir(blender.ops.refmesh):
        rna = getattr(blender.ops.refmesh, name).get_rna_type()
        unexplained += [f"{name}.{item.identifier}" for item in rna.properties if not item.is_hidden and not item.description]
    settings = blender.types.Object.bl_rna.properties["refmesh"].fixed_type.properties["settings"].fixed_type
    unexplained += [item.identifier for item in settings.properties if item.identifier != "name" and not item.description]
    assert [name for name in unexplained if not name.endswith("rna_type")] == []


def test_panel_and_operators_show_every_setting_with_its_range(blender, ball):
    shown = ball.refmesh.settings.bl_rna.properties
    passed = blender.ops.refmesh.run_all.get_rna_type().properties
    for setting in flat_fields():
        for item in (shown[setting.name], passed[setting.name]):
            assert item.description == setting.metadata["help"]
            if setting.metadata["low"] is not None:
                assert (item.hard_min, item.hard_max) == (setting.metadata["low"], setting.metadata["high"])
            if setting.metadata["choices"]:
                assert list(item.enum_items.keys()) == list(setting.metadata["choices"])


def test_every_step_has_a_page_whose_pictures_are_there(blender):
    for step in blender.ops.refmesh.help.get_rna_type().properties["page"].enum_items:
        assert blender.ops.refmesh.help(page=step.identifier) == {"FINISHED"}
        page = ROOT / "docs" / "panel" / f"{step.identifier}.md"
        for picture in re.findall(r"!\[.*?\]\((.*?)\)", page.read_text()):
            assert (page.parent / picture).is_file(), picture
