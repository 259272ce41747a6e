"""Who may import whom, read from the sources."""

import ast
from pathlib import Path

import pytest

ADDON = Path(__file__).resolve().parents[2] / "refmesh_addon"
BLENDER_SIDE = {"bridge", "operators", "ui", "properties", "registration", "preferences"}
# Package -> where it may be imported.
LIMITED = {"bpy": BLENDER_SIDE, "mathutils": BLENDER_SIDE, "pymeshlab": set(), "trimesh": {"io"}}
# Floor -> floors it may import.
FLOORS = {
    "core": set(),
    "io": {"core"},
    "pipeline": {"core", "io"},
    "bridge": {"core", "io"},
}
SOURCES = sorted(ADDON.rglob("*.py"))


def imports(path: Path) -> list[tuple[int, str]]:
    """(level, module) of every import in the file; a relative one without a module gives the names it takes."""
    found = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found += [(0, name.name) for name in node.names]
        elif isinstance(node, ast.ImportFrom):
            found += [(node.level, node.module)] if node.module else [(node.level, name.name) for name in node.names]
    return found


def floor(path: Path) -> str:
    """Folder or module directly under the add-on."""
    return path.relative_to(ADDON).parts[0].removesuffix(".py")


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ADDON)))
def test_imports_stay_on_their_floor(path):
    here, depth = floor(path), len(path.relative_to(ADDON).parts)
    for level, module in imports(path):
        top = module.split(".")[0]
        if level == 0:
            assert top != "refmesh_addon", "relative imports only: Blender gives the package another name"
            assert here in LIMITED.get(top, {here}), f"{top} belongs in {sorted(LIMITED[top])}"
        elif level == depth and here in FLOORS:  # from the add-on's own folder
            assert top in FLOORS[here] | {here}, f"{here} must not import {top}"


def test_table_covers_the_addon():
    assert set(FLOORS) <= {floor(path) for path in SOURCES}
