"""Colors of the centers by an attribute, which is stored on the points, so that a saved scene can switch to another."""

from __future__ import annotations

import bpy
import numpy as np

from ...core.evaluation.error_scale import TABLE, to_linear
from ..scene.meshes import set_colors

GOLDEN = 0.618034  # golden ratio: turns of the color circle from one body to the next, so that consecutive numbers never look alike
BRIGHT = 95.0  # percentile at the bright end, so that a few outliers do not darken the rest
DARKEST, BRIGHTEST = 0.05, 0.9  # linear; no point is black or overexposed


def set_attributes(centers: bpy.types.Object, attributes: dict[str, np.ndarray]) -> None:
    """Stores (C,) values under each name as an attribute of the points."""
    for name, values in attributes.items():
        attribute = centers.data.attributes.get(name) or centers.data.attributes.new(name, "FLOAT", "POINT")
        attribute.data.foreach_set("value", values.astype(np.float32))


def color_centers(centers: bpy.types.Object, choice: str, positions: np.ndarray) -> str:
    """Colors the points by an attribute, or by their (C, 3) `positions`; returns a description of the range."""
    attribute = centers.data.attributes.get(choice.lower())
    if attribute is None:
        set_colors(centers.data, colors_by_place(positions))
        return ""
    values = np.empty(len(positions), dtype=np.float32)
    attribute.data.foreach_get("value", values)
    if choice == "BODY":
        set_colors(centers.data, colors_by_number(values))
        return f"{int(values.max()) + 1} bodies"
    top = float(np.percentile(values, BRIGHT))
    set_colors(centers.data, colors_by_size(values, top))
    return f"dark: 0, bright: {top:.3g} center spacings and more"


def colors_by_place(positions: np.ndarray) -> np.ndarray:
    """(C, 4) linear colors: x, y and z as red, green and blue, to see which part moved where."""
    low, extent = positions.min(axis=0), np.ptp(positions, axis=0)
    shares = (positions - low) / np.where(extent > 0, extent, 1.0)
    return np.column_stack([DARKEST + (BRIGHTEST - DARKEST) * shares, np.ones(len(positions))])


def colors_by_number(numbers: np.ndarray) -> np.ndarray:
    """(C, 4) linear colors, one for each number."""
    hue = (numbers * GOLDEN) % 1.0
    waves = 0.5 + 0.5 * np.cos(2 * np.pi * (hue[:, None] - np.array([0.0, 1.0, 2.0]) / 3))
    return np.column_stack([DARKEST + (BRIGHTEST - DARKEST) * waves, np.ones(len(numbers))])


def colors_by_size(values: np.ndarray, top: float) -> np.ndarray:
    """(C, 4) linear colors from dark for 0 to bright for `top`."""
    shares = np.clip(values / top, 0.0, 1.0) if top > 0 else np.zeros(len(values))
    steps = np.linspace(0.0, 1.0, len(TABLE))
    colors = np.column_stack([np.interp(shares, steps, TABLE[:, channel]) for channel in range(3)])
    return np.column_stack([to_linear(colors), np.ones(len(values))])
