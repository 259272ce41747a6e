"""Settings go through a flat table and back, and say what they refuse."""

import json
from dataclasses import fields, replace

import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.presets import PRESETS
from refmesh_addon.core.settings import Settings, choices_of, flat_fields


def test_flat_table_and_back():
    changed = Settings.from_flat({"centers": 77, "mapping": "rbf", "smoothness": 0.5, "samples": 123})
    assert changed != Settings()
    assert Settings.from_flat(changed.to_flat()) == changed
    assert Settings.from_flat(json.loads(json.dumps(changed.to_flat()))) == changed
    assert Settings.from_flat({}) == Settings()
    assert changed.to_flat()["resolution"] == Settings().to_flat()["resolution"]


def test_names_are_unique_over_all_stages_and_every_one_has_help():
    names = [item.name for item in flat_fields()]
    assert len(set(names)) == len(names) == len(Settings().to_flat()) == sum(len(fields(stage.default)) for stage in fields(Settings))
    assert all(item.metadata["help"] for item in flat_fields())


def test_defaults_and_presets_are_within_their_own_bounds():
    Settings.from_flat(Settings().to_flat())
    for preset in PRESETS.values():
        flat = Settings.from_flat(preset).to_flat()
        assert {name: flat[name] for name in preset} == preset


@pytest.mark.parametrize("item", [item for item in flat_fields() if item.metadata["low"] is not None], ids=lambda item: item.name)
def test_bounds_are_inclusive_and_named_when_exceeded(item):
    low, high = item.metadata["low"], item.metadata["high"]
    for value in (low, high):
        assert Settings.from_flat({item.name: value}).to_flat()[item.name] == value
    for value in (low - 1, high + 1, float("nan")):
        with pytest.raises(RefMeshError, match=f"--{item.name.replace('_', '-')} is .*from {low} to {high}"):
            Settings.from_flat({item.name: value})


@pytest.mark.parametrize("item", [item for item in flat_fields() if item.metadata["choices"]], ids=lambda item: item.name)
def test_choices_are_named_when_missed(item):
    for choice in item.metadata["choices"]:
        assert Settings.from_flat({item.name: choice}).to_flat()[item.name] == choice
    with pytest.raises(RefMeshError, match=next(iter(item.metadata["choices"]))):
        Settings.from_flat({item.name: "nonsense"})


def test_unknown_names_are_refused_in_one_line():
    with pytest.raises(RefMeshError, match="'centres'") as refusal:
        Settings.from_flat({"centres": 100})
    assert "\n" not in str(refusal.value)


def test_settings_cannot_be_changed():
    with pytest.raises(AttributeError):
        Settings().tracking.centers = 5


@pytest.mark.parametrize("stage", [stage.default for stage in fields(Settings)], ids=lambda stage: type(stage).__name__)
def test_unknown_choices_are_refused_without_the_flat_table_too(stage):
    for item in fields(stage):
        if item.metadata["choices"]:
            with pytest.raises(RefMeshError, match=", ".join(item.metadata["choices"])):
                replace(stage, **{item.name: "nonsense"})


def test_the_choices_of_a_setting():
    assert choices_of("mapping") == ("affinity", "rbf")
