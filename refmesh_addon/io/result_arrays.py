"""The arrays of an output folder, read with a schema, as the folder may come from elsewhere: centers.npz and texture layouts."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np

from ..core.array_layout import check_layouts
from ..core.errors import RefMeshError
from ..core.findings import CENTER_LAYOUTS
from .files import CENTERS_NAME, read_npz

CENTERS = {"frames": "(F) integer", "positions": "(F, C, 3) number"}
LAYOUT = {"uvs": "(U, 2) number", "triangles": "(S, 3) int32 < U"}
_REFERENCE_CENTERS = re.compile(r"(group_[0-9]{3,})_reference_centers")


def read_centers(folder: Path) -> dict[str, np.ndarray]:
    """The tracked centers in an output folder: `frames`, `positions`, their attributes and the reference centers of the groups.

    Arrays that are not known here are left out. Raises RefMeshError, naming the file, when it is missing or damaged.
    """
    path = folder / CENTERS_NAME
    try:
        arrays = read_npz(path)
        optional = {**CENTER_LAYOUTS, **_group_layouts(arrays)}
        known = {name: arrays[name] for name in (*CENTERS, *optional) if name in arrays}
        check_layouts(known, CENTERS, optional)
        _check_finite(known)
        if not known["positions"].size:
            raise ValueError("it holds no centers")
        return known
    except (OSError, ValueError) as error:
        raise RefMeshError(f"{path}: cannot be read ({error}); run the steps again") from error


def _group_layouts(names: Collection[str]) -> dict[str, str]:
    """Of the arrays of each group. Where it lacks centers that other groups have, indices say whose positions these are."""
    layouts = {}
    for group in (match[1] for name in names if (match := _REFERENCE_CENTERS.fullmatch(name))):
        partial = f"{group}_center_indices" in names
        layouts[f"{group}_reference_centers"] = f"({group}, 3) number" if partial else "(C, 3) number"
        layouts |= {f"{group}_center_indices": f"({group}) integer < C"} if partial else {}
    return layouts


def read_layout(path: Path, triangles: int) -> tuple[np.ndarray, np.ndarray]:
    """The texture layout of a group, whose mesh has so many triangles: (U, 2) coordinates and the (S, 3) of each triangle.

    Raises RefMeshError, naming the file, when it is missing, damaged, or belongs to another mesh.
    """
    try:
        uvs, corners = layout_arrays(path)
    except (OSError, ValueError) as error:
        raise RefMeshError(f"{path}: cannot be read ({error}); run the Color step again") from error
    if len(corners) != triangles:
        raise RefMeshError(f"{path}: is the layout of another mesh; run the Color step again")
    return uvs, corners


def layout_arrays(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """The (U, 2) coordinates of any texture layout and the (S, 3) int32 of each triangle.

    Raises OSError when the file cannot be opened, ValueError when it is damaged or holds something else.
    """
    arrays = read_npz(path)
    check_layouts(arrays, LAYOUT)
    _check_finite(arrays)
    return arrays["uvs"], arrays["triangles"]


def _check_finite(arrays: Mapping[str, np.ndarray]) -> None:
    for name, array in arrays.items():
        if not np.isfinite(array).all():
            raise ValueError(f"'{name}' holds values that are not finite numbers")
