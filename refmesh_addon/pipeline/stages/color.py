"""The color stage: the capture's colors on one layout per reference mesh, frame by frame and as one steady texture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...core.color.exposure import evened, gain_between
from ...core.color.frame import BakedFrame
from ...io.images import LARGEST
from ..session.cache import digest
from ..session.cached_map import WorkUnit, cached_map
from ..session.context import Context
from ..session.job import COLOR
from ..session.stage_share import StageShare
from .color_survey import FrameColors, survey
from .color_units import (
    FrameFiles,
    GroupLayout,
    LayoutTexels,
    SteadyColors,
    bake_frame,
    encode_frame,
    encode_steady,
    make_steady,
)
from .deformation import DeformedSequence
from .groups import FrameGroup
from .texture_layouts import texture_layouts

BAKE_SCHEMA = 5
STEADY_SCHEMA = 2
FILES_SCHEMA = 2
MOST_STEADY_FRAMES = 9  # frames of a group whose median makes the steady texture, evenly spread: all are in memory at once
COMPARED_TEXELS = 20_000  # of a frame, whose median ratio gives its exposure
EXTENSIONS = {"png": ".png", "jpeg": ".jpg"}
SURVEY, LAYOUTS, BAKING, STEADY, FILES = (
    StageShare(COLOR, *part) for part in ((0.0, 0.1), (0.1, 0.25), (0.25, 0.8), (0.8, 0.85), (0.85, 1.0))
)


@dataclass(frozen=True)
class ColoredSequence:
    """groups : as deformed.  size : of the textures, 0 for colors of vertices.  layouts : by index of the group, empty without textures.
    baked : by (group, frame).  gains : by frame, what evens its exposure.  steady : by index of the group.
    files : by frame; steady_files : by index of the group; both empty without textures.
    """

    groups: tuple[FrameGroup, ...]
    size: int
    layouts: Mapping[int, GroupLayout]
    baked: Mapping[tuple[int, int], BakedFrame]
    gains: Mapping[int, np.ndarray]
    steady: Mapping[int, SteadyColors]
    files: Mapping[int, FrameFiles]
    steady_files: Mapping[int, FrameFiles]


def color(context: Context, deformed: DeformedSequence) -> ColoredSequence | None:
    """Colors of all frames; None where there are none or where they are switched off."""
    settings = context.settings.color
    colors = survey(context, SURVEY) if settings.texture != "off" else {}
    if not any(frame.colored for frame in colors.values()):
        StageShare(COLOR).skip(context.notify, 1.0)
        return None
    largest = max(frame.size for frame in colors.values())
    size = min(largest, LARGEST) if settings.texture == "auto" or not largest else int(settings.texture)
    layouts = texture_layouts(context, deformed.references, LAYOUTS) if size else {}
    shared = {group.index: _shared(group, layouts, size, deformed) for group in deformed.groups}
    baked = _bake(context, deformed, shared, colors)
    gains = _gains(context, deformed, baked)
    steady = _steady(context, deformed, shared, baked, gains)
    files, steady_files = _files(context, deformed, shared, baked, gains, steady) if size else ({}, {})
    return ColoredSequence(deformed.groups, size, layouts, baked, gains, steady, files, steady_files)


def _shared(group: FrameGroup, layouts: Mapping[int, GroupLayout], size: int, deformed: DeformedSequence) -> LayoutTexels:
    if not size:
        return LayoutTexels(digest(group.key), None, 0)
    layout = layouts[group.index].layout
    return LayoutTexels(digest(layout.uvs.tobytes(), layout.triangles.tobytes(), size), layout, size)


def _bake(
    context: Context, deformed: DeformedSequence, shared: Mapping[int, LayoutTexels], colors: Mapping[int, FrameColors]
) -> Mapping[tuple[int, int], BakedFrame]:
    """By group and frame. A group's mesh in the next group's first frame compares the exposures of the two."""
    units = {}
    for group in deformed.groups:
        for frame in group.reached:
            key = digest(BAKE_SCHEMA, shared[group.index].key, group.key, context.frames.keys[frame], colors[frame].content)
            arguments = lambda group=group, frame=frame: (
                shared[group.index],
                deformed.mesh(group, frame),
                context.frames.mesh(frame),
                context.frames.path(frame),
            )
            number = context.numbers[frame]
            entry = f"color/handover_{group.index:03d}" if frame == group.handover else f"color/frame_{number:04d}"
            units[group.index, frame] = WorkUnit(entry, key, arguments, number)
    return cached_map(context, bake_frame, units, BakedFrame, BAKING)


def _gains(context: Context, deformed: DeformedSequence, baked: Mapping[tuple[int, int], BakedFrame]) -> dict[int, np.ndarray]:
    """What evens the exposure of each frame, by index: compared with its group's first frame, and this with the group before."""
    gains: dict[int, np.ndarray] = {}
    start = np.ones(3)
    for group in deformed.groups:
        first = _compared(baked[group.index, group.frames[0]])
        for frame in group.reached:
            other = _compared(baked[group.index, frame])
            ratio = gain_between(first.colors, other.colors, first.seen & other.seen)
            if frame == group.handover:
                following = start * ratio
            else:
                gains[frame] = start * ratio
        start = following if group.handover is not None else start
    return dict(zip(gains, evened(gains.values()), strict=True))


def _compared(frame: BakedFrame) -> BakedFrame:
    step = max(1, len(frame.colors) // COMPARED_TEXELS)
    return BakedFrame(frame.colors[::step], frame.seen[::step])


def _steady(
    context: Context,
    deformed: DeformedSequence,
    shared: Mapping[int, LayoutTexels],
    baked: Mapping[tuple[int, int], BakedFrame],
    gains: Mapping[int, np.ndarray],
) -> Mapping[int, SteadyColors]:
    units = {}
    for group in deformed.groups:
        chosen = _spread(group.frames, MOST_STEADY_FRAMES)
        own = [gains[frame] for frame in chosen]
        contents = [context.frames.keys[frame] for frame in chosen]
        key = digest(STEADY_SCHEMA, shared[group.index].key, group.key, contents, np.stack(own).tolist())
        arguments = lambda group=group, chosen=chosen, own=own: (
            shared[group.index],
            [baked[group.index, frame] for frame in chosen],
            own,
        )
        units[group.index] = WorkUnit(f"color/steady_{group.index:03d}", key, arguments)
    return cached_map(context, make_steady, units, SteadyColors, STEADY)


def _spread(frames: tuple[int, ...], most: int) -> list[int]:
    """At most so many of the frames, evenly spread, the first and the last among them."""
    if len(frames) <= most:
        return list(frames)
    return [frames[round(position)] for position in np.linspace(0, len(frames) - 1, most)]


def _files(
    context: Context,
    deformed: DeformedSequence,
    shared: Mapping[int, LayoutTexels],
    baked: Mapping[tuple[int, int], BakedFrame],
    gains: Mapping[int, np.ndarray],
    steady: Mapping[int, SteadyColors],
) -> tuple[Mapping[int, FrameFiles], Mapping[int, FrameFiles]]:
    """Pictures of all frames and of the steady textures."""
    units, steady_units = {}, {}
    extension = EXTENSIONS[context.settings.color.texture_format]
    everything = digest(FILES_SCHEMA, [gain.tolist() for gain in gains.values()], context.settings.color.exposure)
    for group in deformed.groups:
        group_key = digest(everything, shared[group.index].key, group.key, [context.frames.keys[frame] for frame in group.frames])
        steady_units[group.index] = WorkUnit(
            f"color/steady_files_{group.index:03d}", group_key, lambda index=group.index: (shared[index], steady[index])
        )
        for frame in group.frames:
            arguments = lambda index=group.index, frame=frame: (
                shared[index],
                baked[index, frame],
                applied(context, gains[frame]),
                steady[index],
                extension,
            )
            number = context.numbers[frame]
            units[frame] = WorkUnit(f"color/files_{number:04d}", digest(group_key, number, extension), arguments, number)
    files = cached_map(context, encode_frame, units, FrameFiles, FILES.part(0.0, 0.9))
    return files, cached_map(context, encode_steady, steady_units, FrameFiles, FILES.part(0.9, 1.0))


def applied(context: Context, gain: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(3,) gains of a frame and of the steady colors in it: either the frame is evened, or the steady colors take on its exposure."""
    return (gain, np.ones(3)) if context.settings.color.exposure == "even" else (np.ones(3), 1.0 / gain)
