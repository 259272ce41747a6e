"""The deformed frames of an export as a small GLB file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...core.types import TriangleMesh
from ..scene.far_origin import offset_of, place_in_world
from .export import Export
from .frame_groups import diagonal, frame_groups, frame_rate

if TYPE_CHECKING:
    from ...core.color.layout import Layout
    from ...io.refmesh_stream.writer import FrameGroup
    from ...io.small_glb.choice import SmallGlb, WrittenRun

Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])  # Blender's axes to those of glTF


def small_choice(export: Export, **options) -> SmallGlb:
    """The options of `SmallGlb` with what follows from the scene: where the sequence is, and how a mesh is unwrapped."""
    from ...io.small_glb.choice import SmallGlb  # late: SciPy comes with it, and may be missing

    return SmallGlb(placement=Y_UP @ np.array(place_in_world(export.owner.refmesh.root)), unwrap=layout_maker(export), **options)


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
