"""The add-on leaves nothing behind, and what runs without Blender does not ask for it."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import bpy
import pytest

import refmesh_addon
from refmesh_addon.core.options import label_of
from refmesh_addon.core.settings import flat_fields, setting_names
from refmesh_addon.properties.wording import with_labels
from refmesh_addon.ui.layout import SequencePanel
from refmesh_addon.ui.panels import CLASSES
from refmesh_addon.ui.step_settings import CLASSES as ADVANCED
from refmesh_addon.ui.step_settings import FIRST

from .conftest import needs_bpy_module

LONGEST_LABEL = 17  # letters that 45 % of a sidebar of the usual width hold
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
        assert passed[setting.name].description == setting.metadata["help"]
        assert shown[setting.name].description == setting.metadata["help"].replace("0 (auto)", "Auto")
        for item in (shown[setting.name], passed[setting.name]):
            if setting.metadata["low"] is not None:
                assert (item.hard_min, item.hard_max) == (setting.metadata["low"], setting.metadata["high"])
            if setting.metadata["choices"]:
                assert list(item.enum_items.keys()) == list(setting.metadata["choices"])


def test_every_step_has_a_page_whose_pictures_are_there(blender):
    for step in blender.ops.refmesh.help.get_rna_type().properties["page"].enum_items:
        assert blender.ops.refmesh.help(page=step.identifier) == {"FINISHED"}
        page = ROOT / "docs" / "panel" / f"{step.identifier}.html"
        for target in re.findall(r'(?:src|href)="([^":]*?)"', page.read_text()):
            assert (page.parent / target).is_file(), target


def test_every_panel_opens_a_page_that_is_there(blender):
    pages = blender.ops.refmesh.help.get_rna_type().properties["page"].enum_items.keys()
    panels = [cls for cls in CLASSES if issubclass(cls, SequencePanel) and not hasattr(cls, "bl_parent_id")]
    assert len(panels) == 6 and all(cls.bl_label.lower() in pages for cls in panels)


def test_a_step_shows_few_settings_and_all_others_are_in_its_advanced_part():
    first = [name for names in FIRST.values() for name in names]
    assert max(len(names) for names in FIRST.values()) <= 4
    advanced = [name for cls in ADVANCED for stage in cls.stages for name in setting_names(stage)]
    assert {setting.name for setting in flat_fields()} <= {*first, *advanced}


def test_labels_fit_the_panel():
    assert [label for setting in flat_fields() if len(label := label_of(setting)) > LONGEST_LABEL] == []


@pytest.mark.parametrize("name", [setting.name for setting in flat_fields() if setting.metadata["manual"] is not None])
def test_an_automatic_number_has_a_switch_and_never_shows_zero(blender, ball, name):
    settings, manual = ball.refmesh.settings, next(item.metadata["manual"] for item in flat_fields() if item.name == name)
    for automatic, value in ((True, 0), (False, manual)):
        setattr(settings, f"auto_{name}", automatic)
        assert (getattr(settings, name), getattr(settings, f"auto_{name}")) == (value, automatic)
    assert f"auto_{name}" not in settings.to_flat()


def test_messages_in_the_panel_name_no_options_of_the_command_line():
    folders = [ROOT / "refmesh_addon" / name for name in ("core", "io", "pipeline", "bridge", "operators")]
    sources = [path for folder in folders for path in folder.rglob("*.py")]
    texts = [node.value for path in sources for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Constant)]
    messages = [text for text in texts if isinstance(text, str) and re.search(r"--[a-z]", text)]
    assert messages and not any(re.search(r"--[a-z]", with_labels(text)) for text in messages)


@pytest.mark.parametrize(
    "message, shown",
    [
        ("a smaller --group-size may serve it better", "a smaller 'Group Size' may serve it better"),
        ("give a number, or track with --tracking sequence", "give a number, or track with 'Track Over': Sequence"),
        ("--group-size auto chooses groups", "'Group Size': Auto chooses groups"),
        ("leave it out with --frames", "leave it out with 'Frames'"),
        ("a higher --centers follows thin parts better", "a higher 'Detail' follows thin parts better"),
        ("two - dashes -- as in prose", "two - dashes -- as in prose"),
    ],
)
def test_options_are_named_as_the_panel_names_them(message, shown):
    assert with_labels(message) == shown
