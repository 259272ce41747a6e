"""The deformed frames of an export as a small GLB file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ...core.options import option
from ...core.types import TriangleMesh
from ..scene.far_origin import offset_of, place_in_world
from .export import Export
from .frame_groups import described, diagonal, frame_groups, frame_rate

if TYPE_CHECKING:
    from ...core.color.layout import Layout
    from ...io.refmesh_stream.writer import FrameGroup
    from ...io.small_glb.choice import SmallGlb, WrittenRun

Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])  # Blender's axes to those of glTF


@dataclass(frozen=True)
class SmallOptions:
    """Options that formats with a small GLB share."""

    quality: str = option(
        "balanced",
        "Small files: how good and how large",
        choices={
            "small": "Error 0.1 % of the size, textures of 512 pixels",
            "balanced": "Error 0.05 % of the size, textures of 1024 pixels",
            "near_lossless": "Error 0.01 % of the size, textures of 4096 pixels",
        },
    )
    error: float = option(0.0, "Small files: RMS distance from the frames, % of the diagonal; 0 takes the quality's", low=0.0, high=5.0)
    colors: bool = option(True, "Small files: with the steady texture or the colors of vertices")
    texture: int = option(0, "Small files: maximum side of a texture, pixels; 0 takes the quality's", low=0, high=8192)


QUALITIES = {"small": (1e-3, 512), "balanced": (5e-4, 1024), "near_lossless": (1e-4, 4096)}  # error, side of the texture


def small_choice(export: Export, options: SmallOptions, **more) -> SmallGlb:
    """What the options say, with what follows from the scene: where the sequence is, and how a mesh is unwrapped.

    more : other fields of `SmallGlb`.
    """
    from ...io.small_glb.choice import SmallGlb  # late: SciPy comes with it, and may be missing

    error, texture = QUALITIES[options.quality]
    return SmallGlb(
        options.error / 100 or error,
        texture=(options.texture or texture) if options.colors else 0,
        placement=Y_UP @ np.array(place_in_world(export.owner.refmesh.root)),
        unwrap=layout_maker(export),
        **more,
    )


def small_estimate(export: Export, choice: SmallGlb) -> str:
    """How large the file will be, in words."""
    from ...io.small_glb.estimate import estimated

    estimate = estimated(groups_about_root(export, colors=choice.texture > 0), diagonal(export), frame_rate(), choice)
    return f"about {described(estimate.size, estimate.mbps, estimate.error)}"


def small_note(data: bytes, runs: list[WrittenRun]) -> str:
    """How large the file is, in words."""
    frames = sum(len(run.numbers) for run in runs)
    return described(len(data), 8e-6 * len(data) * frame_rate() / frames, max(run.error for run in runs))


def layout_maker(export: Export) -> Callable[[TriangleMesh], Layout]:
    """Gives a mesh a texture layout: that of the export, or a plainer one where that fails."""
    from ...core.color.projected_layout import projected_layout

    return lambda mesh: export.unwrap(mesh) or projected_layout(mesh)


def small_file(export: Export, choice: SmallGlb, mbps: float = 0.0) -> tuple[bytes, list[WrittenRun]]:
    """All groups in one file, each a reduced mesh with a few quantized morph targets, and what became of their frames.

    mbps : the greatest rate, from which the error follows; 0 takes that of the choice.
    """
    from ...io.small_glb.writer import encoded, within_rate

    size, rate = diagonal(export), frame_rate()
    if mbps:
        choice = within_rate(next(groups_about_root(export, colors=False)), size, rate, choice, mbps)
    return encoded(groups_about_root(export, colors=choice.texture > 0), size, rate, choice)


def groups_about_root(export: Export, colors: bool) -> Iterator[FrameGroup]:
    """The groups about the offset that the root carries, so that its rotation turns no large numbers."""
    offset = offset_of(export.owner.refmesh.root)
    return (replace(group, positions=group.positions - offset) for group in frame_groups(export, by_scene_frame=True, colors=colors))
