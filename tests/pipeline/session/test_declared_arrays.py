"""Every array that the cache keeps is declared with its shape and type, so that an entry with another is noticed."""

import ast
from dataclasses import fields, is_dataclass
from importlib import import_module
from pathlib import Path
from typing import Union, get_args, get_origin, get_type_hints

import numpy as np
import pytest

ADDON = Path(__file__).resolve().parents[3] / "refmesh_addon"
KEEPING = {"cached_map": 3, "finished_units": 3, "load_result": 2, "load_or_make_result": 2}  # function -> position of the result type


def kept_types():
    """The result types that the sources name in calls that keep results."""
    for path in sorted((ADDON / "pipeline").rglob("*.py")):
        calls = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call)]
        for call in calls:
            name = getattr(call.func, "id", getattr(call.func, "attr", ""))
            position = KEEPING.get(name, len(call.args))
            if position < len(call.args) and isinstance(call.args[position], ast.Name) and call.args[position].id[0].isupper():
                module = import_module(".".join(path.relative_to(ADDON.parent).with_suffix("").parts))
                yield getattr(module, call.args[position].id)


def undeclared(kind):
    """Names of the fields that are plain arrays, also in what the type holds."""
    for name, hint in get_type_hints(kind, include_extras=True).items():
        choices = get_args(hint) if get_origin(hint) in (Union, type(int | None)) else (hint,)
        for choice in choices:
            if choice is np.ndarray:
                yield f"{kind.__name__}.{name}"
            elif is_dataclass(choice):
                yield from undeclared(choice)


@pytest.mark.parametrize("kind", sorted(set(kept_types()), key=lambda kind: kind.__name__), ids=lambda kind: kind.__name__)
def test_arrays_are_declared(kind):
    assert fields(kind)
    names = list(undeclared(kind))
    assert not names, f"""declare {names[0]}, as in Annotated[np.ndarray, "(V, 3) float64"]"""
