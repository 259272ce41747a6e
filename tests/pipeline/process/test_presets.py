"""A preset asks for what is installed, and says what it has to do without."""

import pytest

from refmesh_addon.core.presets import PRESETS
from refmesh_addon.core.settings import Settings
from refmesh_addon.pipeline.process import presets
from refmesh_addon.pipeline.process.presets import preset_settings, preset_warning


@pytest.mark.parametrize("name", PRESETS)
def test_with_every_package_a_preset_is_what_it_says(name, monkeypatch):
    monkeypatch.setattr(presets, "_is_installed", lambda: True)
    assert preset_settings(name) == Settings.from_flat(PRESETS[name])
    assert preset_warning(name) == ""


@pytest.mark.parametrize("name", PRESETS)
def test_without_pymeshlab_only_the_reconstruction_changes(name, monkeypatch):
    monkeypatch.setattr(presets, "_is_installed", lambda: False)
    assert preset_settings(name) == Settings.from_flat({**PRESETS[name], "reconstruction": "builtin"})
    assert ("PyMeshLab is not installed" in preset_warning(name)) == (name == "paper")
