"""Wavefront material libraries: the diffuse color and the diffuse image of each material."""

from __future__ import annotations

import re
from dataclasses import dataclass

# Options in front of the file name and how many words follow each at most; the numbers of -o, -s and -t may be one to three.
_OPTIONS = {
    "-blendu": 1,
    "-blendv": 1,
    "-boost": 1,
    "-bm": 1,
    "-cc": 1,
    "-clamp": 1,
    "-colorspace": 1,
    "-imfchan": 1,
    "-mm": 2,
    "-o": 3,
    "-s": 3,
    "-t": 3,
    "-texres": 1,
    "-type": 1,
}
_NUMERIC = ("-o", "-s", "-t", "-mm")  # options that may have fewer values, all of them numbers
_MAPS = ("bump", "disp", "decal", "refl", "norm")  # maps whose keys do not begin with "map_"
_WORD = re.compile(r"\S+")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


@dataclass(frozen=True)
class Material:
    """color : red, green, blue, 0 to 1.  image : file name as written, with forward slashes; "" without one."""

    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    image: str = ""


def parse_mtl(data: bytes) -> dict[str, Material]:
    """Materials by name; lines that cannot be understood are passed over, as every reader does."""
    materials: dict[str, Material] = {}
    name = ""
    for line in data.decode("utf-8", "replace").splitlines():
        key, _, rest = line.strip().partition(" ") if " " in line.strip() else line.strip().partition("\t")
        key, rest = key.lower(), rest.strip()
        if key == "newmtl":
            name = rest
            materials[name] = Material()
        elif key == "kd" and name in materials:
            materials[name] = Material(_color(rest) or materials[name].color, materials[name].image)
        elif key == "map_kd" and name in materials:
            materials[name] = Material(materials[name].color, image_name(rest))
    return materials


def map_names(data: bytes) -> list[str]:
    """The images of all maps of a library, whatever they are for."""
    rows = (line.split(None, 1) for line in data.decode("utf-8", "replace").splitlines())
    maps = (row[1] for row in rows if len(row) == 2 and (row[0].lower().startswith("map_") or row[0].lower() in _MAPS))
    return list(dict.fromkeys(filter(None, map(image_name, maps))))


def image_name(text: str) -> str:
    """The file name behind the options of a map; names may hold spaces."""
    words = list(_WORD.finditer(text))
    at = 0
    while at < len(words) - 1 and words[at][0].lower() in _OPTIONS:
        at = _after_option(words, at)
    return (text[words[at].start() :] if words else "").strip().strip('"').replace("\\", "/")


def _after_option(words: list[re.Match[str]], at: int) -> int:
    """The word behind an option and its values, of which the last word of the line, a file name, is never one."""
    option = words[at][0].lower()
    last = min(at + _OPTIONS[option], len(words) - 2)
    at += 1
    while at <= last and (option not in _NUMERIC or _NUMBER.fullmatch(words[at][0])):
        at += 1
    return at


def _color(text: str) -> tuple[float, float, float] | None:
    try:
        values = [min(max(float(word), 0.0), 1.0) for word in text.split()[:3]]
    except ValueError:
        return None
    return (values[0], values[1], values[2]) if len(values) == 3 else None
