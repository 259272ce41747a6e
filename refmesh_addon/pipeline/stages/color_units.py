"""The work on one group or frame in the stage of color, as worker processes do it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from ...core.color.exposure import exposed
from ...core.color.frame import BakedFrame, bake_texels, bake_vertices, without_color
from ...core.color.layout import Layout, LayoutQuality, measured
from ...core.color.steady import filled, median_seen, steady_texture
from ...core.color.texels import Texels
from ...core.latest import latest_only
from ...core.types import FrozenArrays, Keyed, TriangleMesh
from ...io.appearance import parse_appearance
from ...io.images import encoded
from ...io.meshes import read_bytes
from ..session.layouts import best_layout


@dataclass(frozen=True)
class GroupLayout:
    """layout, quality : of a group's reference mesh.  source : "own", a UV map of the user's, or what `best_layout` names."""

    layout: Layout
    quality: LayoutQuality
    source: str


@dataclass(frozen=True, eq=False)
class LayoutTexels(Keyed):
    """A layout at a size, for which each process works out the texels once.  layout : None for colors of vertices."""

    key: str
    layout: Layout | None
    size: int


@dataclass(frozen=True)
class SteadyColors(FrozenArrays):
    """colors : (N, 3) uint8.  seen : (N,) bool, whether any frame shows the texel or vertex."""

    colors: Annotated[np.ndarray, "(N, 3) uint8"]
    seen: Annotated[np.ndarray, "(N) bool"]


@dataclass(frozen=True)
class FrameFiles(FrozenArrays):
    """The bytes of files, uint8.  image : picture of a frame.  mask : white where it shows the capture.  filled : share of texels."""

    image: Annotated[np.ndarray, "(I) uint8"]
    mask: Annotated[np.ndarray, "(M) uint8"]
    filled: float


@latest_only
def texels_of(shared: LayoutTexels) -> Texels:
    """The texels of a layout, worked out once per process."""
    assert shared.layout is not None
    return Texels.of(shared.layout, shared.size)


def make_layout(mesh: TriangleMesh, own: Layout | None) -> GroupLayout:
    """Layout of a reference mesh.  own : a UV map of the user's, which is taken as it is."""
    layout, source = best_layout(mesh) if own is None else (own, "own")
    return GroupLayout(layout, measured(mesh, layout), source)


def bake_frame(shared: LayoutTexels, deformed: TriangleMesh, source: TriangleMesh, path: Path) -> BakedFrame:
    """Color of one frame, at the texels of a layout or at the vertices."""
    appearance = parse_appearance(read_bytes(path), path)[0]
    if shared.layout is None:
        return without_color(len(deformed.vertices)) if appearance is None else bake_vertices(deformed, source, appearance)
    texels = texels_of(shared)
    return without_color(len(texels.pixels)) if appearance is None else bake_texels(deformed, shared.layout, texels, source, appearance)


def make_steady(shared: LayoutTexels, frames: list[BakedFrame], gains: list[np.ndarray]) -> SteadyColors:
    """The steady texture of some frames, each brought to one exposure by its (3,) gain."""
    colors = np.stack([exposed(frame.colors, gain) for frame, gain in zip(frames, gains, strict=True)])
    seen = np.stack([frame.seen for frame in frames])
    if shared.layout is None:
        return SteadyColors(median_seen(colors, seen), seen.any(axis=0))
    return SteadyColors(*steady_texture(texels_of(shared), colors, seen))


def finished(frame: BakedFrame, gain: np.ndarray, steady: SteadyColors, steady_gain: np.ndarray) -> np.ndarray:
    """(N, 3) uint8: a frame's colors times its gain, and what it does not show from the steady colors times theirs."""
    return filled(exposed(frame.colors, gain), frame.seen, exposed(steady.colors, steady_gain), steady.seen)


def encode_frame(
    shared: LayoutTexels, frame: BakedFrame, gains: tuple[np.ndarray, np.ndarray], steady: SteadyColors, extension: str
) -> FrameFiles:
    """The files of one frame.  gains : (3,) of the frame, and of the steady colors."""
    texels, colors = texels_of(shared), finished(frame, gains[0], steady, gains[1])
    mask = texels.image(np.where(frame.seen, 255, 0).astype(np.uint8))
    image, shown = encoded(texels.image(colors), extension), encoded(mask, ".png")
    return FrameFiles(np.frombuffer(image, np.uint8), np.frombuffer(shown, np.uint8), float((~frame.seen & steady.seen).mean()))


def encode_steady(shared: LayoutTexels, steady: SteadyColors) -> FrameFiles:
    """The files of the steady texture: always without loss, as it is painted on."""
    texels = texels_of(shared)
    mask = texels.image(np.where(steady.seen, 255, 0).astype(np.uint8))
    image, shown = encoded(texels.image(steady.colors), ".png"), encoded(mask, ".png")
    return FrameFiles(np.frombuffer(image, np.uint8), np.frombuffer(shown, np.uint8), 0.0)
