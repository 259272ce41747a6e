"""What the benchmarks of the tracker share: its options, its input and its loop."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator
from dataclasses import Field, fields
from pathlib import Path

import numpy as np

from refmesh_addon.core.capture.pieces import pieces_of
from refmesh_addon.core.capture.transients import visits
from refmesh_addon.core.geometry.mesh import merged, submesh, vertex_components
from refmesh_addon.core.settings import Settings, TrackingSettings
from refmesh_addon.core.tracking.forward import TrackedFrame, first_frame
from refmesh_addon.core.tracking.population import Change, advanced
from refmesh_addon.core.tracking.volume import Volume, sample_volume
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.discovery import find_sequence
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.pipeline.session.parallel import one_ahead

FIELDS = {field.name: field for field in fields(TrackingSettings)}


def read_bodies(source: str | Path, frames: str = "") -> list[TriangleMesh]:
    """The meshes of a sequence as the pipeline tracks them, coincident vertices merged."""
    return [merged(read_mesh(frame.path))[0] for frame in find_sequence(source, frames).frames]


def tracked(
    meshes: Iterable[TriangleMesh], settings: TrackingSettings, start: TrackedFrame | None = None
) -> Iterator[tuple[TrackedFrame, Volume]]:
    """State and volume of frame after frame, as the pipeline tracks them.

    start : state of the first frame, where it is known already.
    """
    state, earlier, meshes = start, None, list(meshes)
    volume_of = lambda mesh: sample_volume(mesh, settings.resolution, settings.centers)
    shown = visits(pieces_of(mesh) for mesh in meshes)
    for index, volume in enumerate(one_ahead(volume_of, meshes)):
        if index:
            before, now = meshes[index - 1], meshes[index]
            leaving, coming = shown.leaving[index - 1], shown.coming[index]
            rest = volume_of(_pieces(now, coming, False)) if len(coming) else volume
            left, new = (_pieces(mesh, pieces) if len(pieces) else None for mesh, pieces in ((before, leaving), (now, coming)))
            change = Change(left, new, rest, None if len(leaving) else lambda volume=earlier: volume)
            state = advanced(state, volume, change, settings)
        elif state is None:
            state = first_frame(volume, settings)
        earlier = volume
        yield state, volume


def _pieces(mesh: TriangleMesh, chosen: np.ndarray, keep: bool = True) -> TriangleMesh:
    """The chosen pieces of a mesh, or all others."""
    piece = vertex_components(mesh)[1][mesh.triangles[:, 0]]
    return submesh(mesh, np.isin(piece, chosen) == keep)[0]


def add_tracking_options(parser: argparse.ArgumentParser, resolution: int) -> None:
    """--centers, --resolution, --affinity, and --set for every other field of the settings."""
    parser.add_argument("--centers", type=int, default=FIELDS["centers"].default)
    parser.add_argument("--resolution", type=int, default=resolution, help="voxels along the longest side (default: %(default)s)")
    parser.add_argument("--affinity", default=FIELDS["affinity"].default, choices=FIELDS["affinity"].metadata["choices"])
    to_setting = assignment(FIELDS.values())
    parser.add_argument("--set", action="append", default=[], type=to_setting, metavar="NAME=VALUE", help="any field of TrackingSettings")


def tracking_settings(arguments: argparse.Namespace) -> TrackingSettings:
    """The settings that the options ask for. Raises RefMeshError for a value out of range."""
    given = {name: getattr(arguments, name) for name in ("centers", "resolution", "affinity")}
    return Settings.from_flat({**given, **dict(arguments.set)}).tracking


def assignment(settings: Iterable[Field]) -> Callable[[str], tuple[str, object]]:
    """What turns NAME=VALUE into the name and value of one of these settings."""
    types = {item.name: type(item.default) for item in settings}

    def convert(text: str) -> tuple[str, object]:
        name, _, value = text.partition("=")
        if name not in types:
            raise argparse.ArgumentTypeError(f"'{name}' is not one of {', '.join(types)}")
        try:
            return name, types[name](value)
        except ValueError as error:
            raise argparse.ArgumentTypeError(f"'{text}': {error}") from error

    return convert
