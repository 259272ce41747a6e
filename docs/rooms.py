"""The map of rooms: an SVG of the add-on's packages, read from their sources. Part of `make pictures`; alone: python docs/rooms.py

A package is a box, its rooms are the lines inside in the order that the layer test guards, each with the first sentence of its docstring.
"""

from __future__ import annotations

import ast
from html import escape
from pathlib import Path
from textwrap import wrap

ROOT = Path(__file__).resolve().parents[1]
ADDON = ROOT / "refmesh_addon"
LAYERS = ROOT / "tests" / "packaging" / "test_layers.py"
TARGET = ROOT / "docs" / "pictures" / "rooms.svg"
# Packages side by side in each row; a row imports from the rows below it. Blender's side is left, the worker process right.
ROWS = (("ui", "operators"), ("properties",), ("bridge", "pipeline"), ("io",), ("core",))
FILLS = {"pipeline": "#fff4d6", "io": "#fff4d6", "core": "#e2f0d9"}
BLENDER_FILL = "#dbe8f7"  # of packages that import bpy
NOTE = "A box imports from boxes below it only, a room from the rooms below it in its box. Blue boxes import bpy; ui calls operators by id."
WIDTH, MARGIN, GAP, PADDING = 1200, 16, 14, 12  # pixels
LINE, NAME = 19, 112  # height of a line of text; width of the column of names
CHARACTER = 6.6  # mean width of one in the font below
STYLE = "text{font:13px sans-serif;fill:#222}.name{font-weight:bold}.package{font:bold 15px sans-serif}.note{fill:#666}"


def main() -> None:
    """Writes the map."""
    TARGET.write_text(drawn_map(), encoding="utf-8")
    print(f"{TARGET.relative_to(ROOT)}  {TARGET.stat().st_size / 1000:.0f} kB")


def drawn_map() -> str:
    """The map as SVG."""
    parts, top = [], MARGIN
    for row in ROWS:
        width = (WIDTH - 2 * MARGIN - GAP * (len(row) - 1)) / len(row)
        boxes = [contents(package, width) for package in row]
        height = max(map(len, boxes)) * LINE + 2 * PADDING + LINE
        for column, (package, lines) in enumerate(zip(row, boxes, strict=True)):
            parts += box(package, lines, (MARGIN + column * (width + GAP), top, width, height))
        top += height + GAP
    parts.append(text(MARGIN, top + 6, NOTE, "note"))
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {top + MARGIN}" width="{WIDTH}" height="{top + MARGIN}">'
    return "\n".join([head, f"<style>{STYLE}</style>", '<rect width="100%" height="100%" fill="white"/>', *parts, "</svg>\n"])


def contents(package: str, width: float) -> list[tuple[str, str]]:
    """(name, text) of each line in the box of a package: its rooms, top down."""
    characters = int((width - NAME - 2 * PADDING) / CHARACTER)
    lines = []
    for room in sorted_rooms(package):
        first, *rest = wrap(purpose(ADDON / package / room), characters)
        lines += [(room, first), *(("", line) for line in rest)]
    return lines or [("", line) for line in wrap(purpose(ADDON / package), int((width - 2 * PADDING) / CHARACTER))]


def box(package: str, lines: list[tuple[str, str]], place: tuple[float, float, float, float]) -> list[str]:
    """The SVG elements of a package. place : left, top, width and height."""
    left, top, width, height = place
    fill = FILLS.get(package, BLENDER_FILL)
    elements = [f'<rect x="{left:g}" y="{top:g}" width="{width:g}" height="{height:g}" rx="6" fill="{fill}" stroke="#777"/>']
    at = top + PADDING + LINE * 0.75
    elements.append(text(left + PADDING, at, package, "package"))
    has_rooms = any(name for name, _ in lines)
    for name, line in lines:
        at += LINE
        elements += [text(left + PADDING, at, name, "name")] if name else []
        elements.append(text(left + PADDING + (NAME if has_rooms else 0), at, line))
    return elements


def text(left: float, base: float, content: str, kind: str = "") -> str:
    """An SVG text element."""
    return f'<text x="{left:g}" y="{base:g}"{f" class={chr(34)}{kind}{chr(34)}" if kind else ""}>{escape(content)}</text>'


def purpose(folder: Path) -> str:
    """The first sentence of the docstring of a package."""
    docstring = ast.get_docstring(ast.parse((folder / "__init__.py").read_text(encoding="utf-8"))) or ""
    return " ".join(docstring.partition("\n\n")[0].split())


def sorted_rooms(package: str) -> list[str]:
    """The rooms of a package, each above those that it may import, as the layer test has them."""
    for node in ast.parse(LAYERS.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "ROOMS":
            return ast.literal_eval(node.value).get(package, [])
    raise SystemExit(f"docs/rooms.py: {LAYERS.name} has no ROOMS any more")


if __name__ == "__main__":
    main()
