"""What is checked of a report.json before anything it names is opened: types, ranges, and that all paths stay in its folder.

The types are those of `GroupReport` and `FrameReport`; entries of later versions that are not known here are left alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from pathlib import Path, PurePosixPath, PureWindowsPath
from types import NoneType
from typing import Any, get_args, get_type_hints

from ..core.errors import RefMeshError
from ..core.options import check_value
from ..core.settings import flat_fields

# Fields that hold a path relative to the output folder.
PATHS = {"reference", "playback", "visibility", "layout", "texture", "texture_mask", "deformed", "colored", "centers_playback"}
LARGEST_NUMBER = 10**18  # of a frame or a group


def check_report(report: object, folder: Path, kinds: Mapping[str, type]) -> None:
    """Raises ValueError, naming the entry, for a report that is not as `Report.to_dict` gives it.

    folder : that it is in.  kinds : the dataclass of the entries of each of its lists; "groups" and "frames" have to be there.
    """
    if not isinstance(report, dict):
        raise ValueError("it is not an object")
    for key, kind in kinds.items():
        if key in report or key in ("groups", "frames"):
            _check_entries(report, key, kind, folder)
            if any(len(entry.get("position", (0, 0, 0))) != 3 for entry in report[key]):
                raise ValueError(f"a position in '{key}' has not three numbers")
    if any(len(entry["frames"]) not in (0, 2) for entry in report.get("bodies", [])):
        raise ValueError("the frames of an entry of 'bodies' are not first and last")
    sequence = _member(report, "sequence", dict)
    _check_list(sequence, "numbers", lambda entry, name: _check(entry, int, name))
    if not sequence["numbers"]:
        raise ValueError("'numbers' is empty")
    for key, kind in (("tracking", dict), ("settings", dict), ("seconds", dict)):
        _member(report, key, kind)
    _check_numbers(report["groups"], report["frames"])
    _check_settings(report["settings"])
    _check(report.get("bbox_diagonal", 0.0), float, "bbox_diagonal")
    _check(report.get("offset", [0.0, 0.0, 0.0]), tuple[float, ...], "offset")
    if len(report.get("offset", (0, 0, 0))) != 3:
        raise ValueError("'offset' has not three numbers")
    spacing = report["tracking"].get("center_spacing")
    if spacing is not None:
        _check(spacing, float, "center_spacing")
    if report.get("centers_playback") is not None:
        _check_path(report["centers_playback"], "centers_playback", folder)


def _check_entries(report: dict, key: str, kind: type, folder: Path) -> None:
    _check_list(report, key, lambda entry, name: _check_entry(entry, kind, name, folder))


def _check_numbers(groups: list[dict], frames: list[dict]) -> None:
    for index, group in enumerate(groups):
        if group["index"] != index or not group["frames"]:
            raise ValueError(f"'groups[{index}]' has another index or no frames")
    if len({frame["number"] for frame in frames}) < len(frames):
        raise ValueError("'frames' has a frame twice")


def _check_settings(settings: dict) -> None:
    known = {item.name: item for item in flat_fields()}
    for name in settings.keys() & known.keys():
        try:
            check_value(known[name], settings[name])
        except (RefMeshError, TypeError) as error:
            raise ValueError(str(error)) from error


def _member(entry: Mapping[str, Any], key: str, kind: type) -> Any:
    if not isinstance(entry.get(key), kind):
        raise ValueError(f"'{key}' is missing or of another type")
    return entry[key]


def _check_list(entry: Mapping[str, Any], key: str, check: Callable[[object, str], None]) -> None:
    for index, item in enumerate(_member(entry, key, list)):
        check(item, f"{key}[{index}]")


def _check_entry(entry: object, schema: type, name: str, folder: Path) -> None:
    if not isinstance(entry, dict):
        raise ValueError(f"'{name}' is not an object")
    hints = _hints(schema)
    for item in fields(schema):
        if item.name in entry:
            _check(entry[item.name], hints[item.name], f"{name}.{item.name}")
            if item.name in PATHS:
                _check_path(entry[item.name], f"{name}.{item.name}", folder)
        elif item.default is MISSING:
            raise ValueError(f"'{name}.{item.name}' is missing")


@cache
def _hints(schema: type) -> dict[str, Any]:
    return get_type_hints(schema)


def _check(value: object, hint: Any, name: str) -> None:
    """A value against the type of its field."""
    choices = [choice for choice in get_args(hint) if choice is not NoneType] if NoneType in get_args(hint) else [hint]
    if not any(_fits(value, choice) for choice in choices):
        raise ValueError(f"'{name}' is {_shown(value)}, which is of another type or out of range")


def _fits(value: object, hint: Any) -> bool:
    if is_dataclass(hint):
        return isinstance(value, dict) and all(_fits(value.get(item.name), float) for item in fields(hint))
    if get_args(hint):  # tuple[X, ...]
        return isinstance(value, list) and all(_fits(item, get_args(hint)[0]) for item in value)
    if hint is float:
        return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 1e300 and math.isfinite(value)
    if hint is int:
        return isinstance(value, int) and not isinstance(value, bool) and abs(value) < LARGEST_NUMBER
    return isinstance(value, hint)


def _check_path(value: object, name: str, folder: Path) -> None:
    """Refuses absolute paths of any system, ways out of the folder, and links that lead out of it."""
    if value is None:
        return
    text = value if isinstance(value, str) else ""
    pure = PurePosixPath(text.replace("\\", "/"))
    if not text or "\0" in text or pure.is_absolute() or PureWindowsPath(text).drive or ".." in pure.parts:
        raise ValueError(f"'{name}' is {_shown(value)}, which is not a path inside the folder of the report")
    try:
        inside = (folder / text).resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError) as error:  # a name that is too long, a loop of links
        raise ValueError(f"'{name}' is {_shown(value)}, which cannot be opened") from error
    if not inside:
        raise ValueError(f"'{name}' leads out of the folder of the report")


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
