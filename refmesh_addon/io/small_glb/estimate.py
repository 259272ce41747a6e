"""How large a small GLB will be, from a coarse mesh that stands for the segment: in about the time of reducing it once."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...core.color.appearance import Appearance
from ...core.compression.morph_targets import MorphTargets
from ...core.compression.reduction import reduced
from ..images import encoded
from ..refmesh_stream.estimate import Estimate
from ..refmesh_stream.writer import FrameGroup
from .choice import SmallGlb
from .meshopt import encoded_attributes
from .segment import TRIANGLE_BITS, fitted_runs
from .surface import texture_size
from .triangle_order import packing_order

COARSE = 2000  # triangles of the mesh that stands for a segment
USED_UP = 0.7  # of the error, by reducing triangles: between ENOUGH, from which on more triangles are not tried, and all of it
NORMAL_BYTES = {True: 2.0, False: 4.0}  # of a normal, by whether it is packed
UV_BYTES = {True: 2.5, False: 4.0}  # likewise of a texture coordinate
COLOR_BYTES = {True: 5.0, False: 8.0}  # likewise of a color
SEAMS = 1.25  # vertices of a mesh with a layout over those without
DOCUMENT, RUN_ENTRY, FRAME_ENTRY = 1500, 900, 4  # bytes of the JSON, of what a run adds to it, and of a frame's weight or time


def estimated(groups: Iterable[FrameGroup], diagonal: float, frame_rate: float, choice: SmallGlb) -> Estimate:
    """Of the file that `write_small_glb` would write: mostly within a third, up to 60 % off where frames fall into other runs."""
    size, frames = float(DOCUMENT), 0
    for group in groups:
        size += _segment_bytes(group, choice, choice.error * diagonal)
        frames += len(group.numbers)
    return Estimate(round(size), 8e-6 * size * frame_rate / frames, choice.error)


def _segment_bytes(group: FrameGroup, choice: SmallGlb, error: float) -> float:
    coarse = reduced(group.positions, group.triangles, COARSE)
    triangles, order = packing_order(coarse.triangles, coarse.frames.shape[1])
    count = _triangles_needed(len(triangles), coarse.error, error, [min(count, len(group.triangles)) for count in choice.triangles])
    left = error * (np.sqrt(1.0 - USED_UP**2) if count < len(group.triangles) else 1.0)
    growth, colors = count / len(triangles), group.appearance if choice.texture else None
    vertices = growth * len(order) * (SEAMS if colors is not None and colors.images else 1.0)
    size = count * (TRIANGLE_BITS / 8 if choice.packed else 3 * (2 if vertices < 0xFFFF else 4)) + _color_bytes(colors, vertices, choice)
    for rows, model in fitted_runs(coarse.frames[:, order], triangles, float(left), choice.targets):
        size += vertices / len(order) * _shape_bytes(model, growth, choice.packed) + RUN_ENTRY
        size += (rows.stop - rows.start) * FRAME_ENTRY * (1 + len(model.targets))
        size += vertices * NORMAL_BYTES[choice.packed] if colors is None and choice.normals else 0.0
    return size


def _triangles_needed(coarse: int, coarse_error: float, error: float, choices: list[int]) -> int:
    """The first of the choices that is enough: the distance of a reduced surface falls as the size of a triangle, so with their number."""
    needed = coarse * coarse_error / (USED_UP * error)
    return next((count for count in choices if count >= needed), choices[-1])


def _shape_bytes(model: MorphTargets, growth: float, packed: bool) -> float:
    """Of base and targets, where there are `growth` times as many vertices, neighbors of which are nearer to each other by its root."""
    if not packed:
        wide = np.abs(model.targets).max(initial=0) > 127
        return len(model.base) * (8.0 + len(model.targets) * (8 if wide else 4))
    finer = [np.cumsum(np.rint(np.diff(shape, axis=0, prepend=0) / np.sqrt(growth)), axis=0) for shape in (model.base, *model.targets)]
    words = np.zeros((sum(map(len, finer)), 4), "<u2")
    words[:, :3] = np.concatenate(finer).astype(np.int64) & 0xFFFF
    return float(len(encoded_attributes(words.view(np.uint8).reshape(len(words), -1))))


def _color_bytes(colors: Appearance | None, vertices: float, choice: SmallGlb) -> float:
    if colors is None:
        return 0.0
    if not colors.images:
        return vertices * COLOR_BYTES[choice.packed]
    image = max(colors.images, key=lambda picture: picture.size)
    step = max(1, max(image.shape[:2]) // texture_size(colors, choice.texture))  # the new texture takes about what this one does
    return vertices * UV_BYTES[choice.packed] + len(encoded(np.ascontiguousarray(image[::step, ::step]), choice.image))
