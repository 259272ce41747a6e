"""Who may import whom, read from the sources."""

import ast
from pathlib import Path

import pytest

ADDON = Path(__file__).resolve().parents[2] / "refmesh_addon"
BLENDER_SIDE = {"bridge", "operators", "ui", "properties", "registration", "preferences"}
# Package -> where it may be imported.
LIMITED = {
    "bpy": BLENDER_SIDE,
    "mathutils": BLENDER_SIDE,
    "trimesh": {"io"},
    "PIL": {"io"},
    "xatlas": {"pipeline"},
    "pymeshlab": {"pipeline"},
    "distributed": {"pipeline"},
}
# Floor -> floors it may import.
FLOORS = {
    "core": set(),
    "io": {"core"},
    "pipeline": {"core", "io"},
    "bridge": {"core", "io"},
}
# Rooms of the core, each of which may import those below it, and those of the other floors; files beside them serve all.
ROOMS = {
    "core": ["compression", "color", "evaluation", "deformation", "reference", "tracking", "surfacing", "capture", "geometry"],
    "pipeline": ["process", "stages", "session"],
    "bridge": ["picture", "formats", "results", "sequence", "scene"],
}
# Files that stand beside the rooms and compose them, above all of them.
ABOVE_ROOMS = {"pipeline": {"run"}, "bridge": {"handlers"}}
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


def resolved(path: Path, level: int, module: str) -> tuple[str, ...]:
    """Parts of an imported module, from the add-on's folder on."""
    folder = path.relative_to(ADDON).parts[:-1]
    return (*folder[: len(folder) - level + 1], *module.split("."))


@pytest.mark.parametrize("path", [path for path in SOURCES if floor(path) in ROOMS], ids=lambda path: str(path.relative_to(ADDON)))
def test_nothing_runs_back_up_between_rooms(path):
    """A file reaches its own room, the rooms below and the files that all rooms share, never a room above."""
    here, inside = floor(path), path.relative_to(ADDON).parts[1]
    order = ROOMS[here]
    for level, module in imports(path):
        target = resolved(path, level, module) if level else ()
        if len(target) < 2 or target[0] != here or inside.removesuffix(".py") in ABOVE_ROOMS.get(here, set()):
            continue
        if target[1] in order:
            assert inside in order, f"{inside} serves every room of {here} and must not import {target[1]}"
            assert order.index(inside) <= order.index(target[1]), f"{here}/{inside} must not import {here}/{target[1]}"


def test_no_module_imports_itself_in_a_circle():
    """Counting the imports at the head of each file, which run when it is loaded."""
    modules = {".".join(path.relative_to(ADDON).with_suffix("").parts): path for path in SOURCES}
    arrows: dict[str, set[str]] = {}
    for name, path in modules.items():
        targets: set[str] = set()
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, ast.ImportFrom) and node.level:
                base = ".".join(resolved(path, node.level, node.module) if node.module else path.relative_to(ADDON).parts[: -node.level])
                targets |= {target for target in [base, *(f"{base}.{alias.name}" for alias in node.names)] if target in modules}
        arrows[name] = targets - {name}
    while arrows:
        leaves = {name for name, targets in arrows.items() if not targets & set(arrows)}
        assert leaves, f"these import each other: {sorted(arrows)}"
        arrows = {name: targets for name, targets in arrows.items() if name not in leaves}


def test_every_room_has_its_place_in_the_order():
    for here, order in ROOMS.items():
        assert sorted(order) == sorted(folder.name for folder in (ADDON / here).iterdir() if (folder / "__init__.py").exists())


def test_table_covers_the_addon():
    assert set(FLOORS) <= {floor(path) for path in SOURCES}
