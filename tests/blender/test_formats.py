"""Adding a format takes its record and nothing else: menu, arguments and the command line are made from the table."""

from __future__ import annotations

import importlib
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from refmesh_addon import operators
from refmesh_addon.bridge.formats import registry
from refmesh_addon.bridge.formats.export import Export
from refmesh_addon.core.settings import option
from refmesh_addon.io.files import atomic_file
from refmesh_addon.io.formats import Format

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Options:
    """Of the format under test."""

    digits: int = option(3, "Decimals of a coordinate", low=0, high=9)
    axis: str = option("x", "Which coordinate", choices={"x": "The first", "y": "The second"})


def write(export: Export) -> list:
    """The frames of each group, and the options."""
    target = export.target(".xyz")
    with atomic_file(target) as file:
        lines = [f"{index}: {frames[0]}-{frames[-1]}" for index, frames in export.choice.groups.items()]
        file.write("\n".join([*lines, f"{export.options.digits} {export.options.axis}"]).encode())
    return [target]


XYZ = Format("xyz", "Coordinates", (".xyz",), write=write, contents="Coordinates as text", every_frame=True, options=Options)


@pytest.fixture
def extended_table(monkeypatch):
    """The table of formats with another one, before the add-on is registered."""
    monkeypatch.setitem(registry.FORMATS, XYZ.name, XYZ)
    _make_operators_anew()
    yield
    monkeypatch.undo()
    _make_operators_anew()


@pytest.fixture
def extended(extended_table, blender):
    """Blender with an add-on that has another format."""
    return blender


def _make_operators_anew() -> None:
    importlib.reload(operators.export)
    importlib.reload(operators)


def test_it_is_written_with_the_options_of_the_operator(extended, solved, results):
    extended.ops.refmesh.export(format="xyz", xyz_axis="y")
    lines = (results / "export" / "ball.xyz").read_text().splitlines()
    assert lines == ["0: 6-9", "1: 10-11", "3 y"]  # 9 is missing and holds frame 8


def test_menu_and_arguments_have_name_help_bounds_and_choices(extended):
    arguments = extended.ops.refmesh.export.get_rna_type().properties
    item = arguments["format"].enum_items["xyz"]
    assert (item.name, item.description) == ("Coordinates", "Coordinates as text")
    digits = arguments["xyz_digits"]
    assert (digits.description, digits.default, digits.hard_min, digits.hard_max) == ("Decimals of a coordinate", 3, 0, 9)
    assert arguments["xyz_axis"].enum_items.keys() == ["x", "y"]


def test_options_of_the_command_line_are_those_of_the_format(extended, monkeypatch, capsys):
    monkeypatch.syspath_prepend(str(ROOT / "headless"))
    parser = importlib.import_module("operator_options").make_parser(extended, "")
    arguments = parser.parse_args("in --output out --export xyz --export-xyz-digits 5 --export-xyz-axis y".split())
    assert (arguments.export, arguments.export_xyz_digits, arguments.export_xyz_axis) == (["xyz"], 5, "y")
    with pytest.raises(SystemExit):
        parser.parse_args("in --output out --export-xyz-digits 10".split())
    assert "--export-xyz-digits: '10' is not a number from 0 to 9" in capsys.readouterr().err


def test_its_limits_are_told(extended, solved, monkeypatch):
    with pytest.raises(RuntimeError, match="--export xyz: every frame of the range is written; .* pc2, glb, .* ply or refmesh"):
        extended.ops.refmesh.export(format="xyz", step=2)
    lacking = replace(XYZ, unavailable=lambda: "the Python package 'xyz' is missing")
    monkeypatch.setitem(registry.FORMATS, XYZ.name, lacking)
    with pytest.raises(RuntimeError, match="--export xyz: the Python package 'xyz' is missing; choose pc2"):
        extended.ops.refmesh.export(format="xyz", only_check=True)


def test_a_scene_file_of_another_kind_is_refused(blender, tmp_path):
    with pytest.raises(RuntimeError, match=r"take\.fbx: '\.fbx' is not a scene file that can be read; give one of \.abc, \.usd"):
        blender.ops.refmesh.import_scene(filepath=str(tmp_path / "take.fbx"))
    for known in registry.FORMATS.values():
        if known.load and not known.unavailable():
            with pytest.raises(RuntimeError, match=rf"gone\{known.extensions[0]}: no such file"):
                blender.ops.refmesh.import_scene(filepath=str(tmp_path / f"gone{known.extensions[0]}"))
