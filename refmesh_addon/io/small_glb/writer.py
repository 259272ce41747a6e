"""Writes a sequence as a small GLB: segments of one mesh, runs of frames with a few morph targets, which take turns without a gap."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from ...core.errors import RefMeshError
from ...core.types import TriangleMesh
from ..files import atomic_file
from ..refmesh_stream.writer import FrameGroup
from .choice import SmallGlb, WrittenRun
from .container import Container
from .mesh import SharedParts, run_mesh
from .scene import Shown, add_scene
from .segment import SLACK, Segment, fitted_segment
from .surface import Surface, colored_surface

ERRORS = tuple(2e-4 * 2 ** (step / 2) for step in range(11))  # that are tried for a rate


def write_small_glb(
    path: str | Path, groups: Iterable[FrameGroup], diagonal: float, frame_rate: float, choice: SmallGlb
) -> list[WrittenRun]:
    """Writes the groups, in their order; returns what each run of frames became.

    diagonal : of the bounding box of the whole sequence, scene units.  frame_rate : frames per second; frame n is shown at
    (n - first) / frame_rate seconds. A group that needs more morph targets is written in several runs of frames. Raises RefMeshError when
    the file cannot be written, or the error cannot be reached: it says which can.
    """
    data, written = encoded(groups, diagonal, frame_rate, choice)
    with atomic_file(path) as file:
        file.write(data)
    return written


def encoded(groups: Iterable[FrameGroup], diagonal: float, frame_rate: float, choice: SmallGlb) -> tuple[bytes, list[WrittenRun]]:
    """What `write_small_glb` writes, and what each run became."""
    container, shown, written = Container(choice.packed), [], []
    for group in groups:
        segment = fitted_segment(group, choice, diagonal)
        written += [
            WrittenRun(segment.numbers[run.rows], run.error / diagonal, len(segment.triangles), len(run.model.targets))
            for run in segment.runs
        ]
        shown += _add_segment(container, segment, _surface(group, segment, choice), choice.normals)
    _check_error(written, choice)
    add_scene(container, shown, frame_rate, choice.placement)
    return container.finished(), written


def within_rate(group: FrameGroup, diagonal: float, frame_rate: float, choice: SmallGlb, mbps: float) -> SmallGlb:
    """The choice with the smallest error, of some in equal ratios, whose file of this one group stays within a rate.

    mbps : 10^6 bits per second, of everything but textures. Raises RefMeshError where the largest error tried does not reach it: it says
    what rate does.
    """
    plain = replace(group, appearance=None)
    for error in ERRORS:
        tried = replace(choice, error=error)
        rate = 8e-6 * len(encoded([plain], diagonal, frame_rate, tried)[0]) * frame_rate / len(group.numbers)
        if rate <= mbps:
            return tried
    raise RefMeshError(f"{mbps:g} Mbit/s cannot be reached, {rate:.2g} can, with an error of {100 * ERRORS[-1]:.2g} %; make larger groups")


def _surface(group: FrameGroup, segment: Segment, choice: SmallGlb) -> Surface:
    if group.appearance is None or not choice.texture:
        return colored_surface(segment, None, choice)
    posed = TriangleMesh(group.positions[segment.middle], group.triangles)
    return colored_surface(segment, replace(group.appearance, mesh=posed), choice)


def _add_segment(container: Container, segment: Segment, surface: Surface, normals: bool) -> list[Shown]:
    shared, is_lit = SharedParts.of(container, segment, surface), surface.picture is None and surface.colors is None
    meshes = [run_mesh(container, segment, surface, shared, run, normals and is_lit) for run in segment.runs]
    return [
        Shown(segment.numbers[run.rows], run.model, container.entry("meshes", mesh)) for run, mesh in zip(segment.runs, meshes, strict=True)
    ]


def _check_error(written: list[WrittenRun], choice: SmallGlb) -> None:
    worst = max(written, key=lambda run: run.error)
    if worst.error > choice.error * (1 + SLACK):
        most = f"{choice.targets[1]} morph targets and {worst.triangles} triangles"
        where = f"frames {worst.numbers[0]} to {worst.numbers[-1]}"
        reached = f"{100 * worst.error:.2g}"
        raise RefMeshError(f"{where}: an error of {100 * choice.error:.3g} % cannot be reached with {most}: allow {reached} %")
