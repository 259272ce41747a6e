"""Writes a group of frames as OpenVAT does: a mesh with a second UV set, textures of positions and normals, and a JSON of bounds.

Files and their names are those that its importers look for: NAME.glb, NAME_vat.png, NAME_vnrm.png, NAME_basecolor.png,
NAME-remap_info.json, in a folder NAME_vat. Textures hold Blender's axes, z up; the mesh has those of glTF, y up.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ...core.color.layout import Layout
from ...core.color.projected_layout import projected_layout
from ...core.compression.reduction import reduced
from ...core.geometry.mesh import vertex_normals
from ...core.types import TriangleMesh
from ..files import atomic_file, output_folder
from ..refmesh_stream.writer import FrameGroup
from ..small_glb.choice import SmallGlb
from ..small_glb.container import Container
from ..small_glb.segment import Segment
from ..small_glb.surface import Surface, colored_surface
from .arrangement import Arrangement
from .encoding import EncodedFrames, encoded_frames
from .png import encoded_png

ARRANGEMENTS = {"square": Arrangement.square, "row": Arrangement.row}
EVERY = 1 << 30  # triangles: none is left out
Y_UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # Blender's axes to those of glTF


@dataclass(frozen=True)
class VatChoice:
    """arrangement : a key of ARRANGEMENTS.  triangles : greatest number.  placement : (4, 4) from scene units to Blender's axes.
    texture : greatest side of the texture, pixels; 0 leaves colors out.  unwrap : makes the layout of a reduced mesh.
    """

    arrangement: str = "square"
    triangles: int = EVERY
    placement: np.ndarray = field(default_factory=lambda: np.eye(4))
    texture: int = 1024
    unwrap: Callable[[TriangleMesh], Layout] = projected_layout


@dataclass(frozen=True)
class WrittenVat:
    """paths : of all files.  largest, rms : what 16 bits move a vertex by, scene units.  degrees : what they turn a normal by at most."""

    paths: list[Path]
    largest: float
    rms: float
    degrees: float


def write_vat(folder: str | Path, name: str, group: FrameGroup, frame_rate: float, choice: VatChoice) -> WrittenVat:
    """Writes a group of frames. Frames whose numbers are missing hold the one before.

    Raises RefMeshError where engines could not read the texture, or a file cannot be written.
    """
    segment = _reduced(group, choice.triangles)
    frames = _held(segment.numbers, segment.frames @ choice.placement[:3, :3].T + choice.placement[:3, 3])
    arrangement = ARRANGEMENTS[choice.arrangement](frames.shape[1], len(frames))
    textures = encoded_frames(frames, segment.triangles, arrangement)
    surface = _surface(group, segment, choice)
    contents = {
        f"{name}.glb": _mesh(frames[0], segment.triangles, surface, arrangement),
        f"{name}_vat.png": encoded_png(textures.positions),
        f"{name}-remap_info.json": _bounds(name, textures, len(frames), frame_rate),
    }
    if textures.normals is not None:
        contents[f"{name}_vnrm.png"] = encoded_png(textures.normals)
    if surface.picture is not None:
        contents[f"{name}_basecolor.png"] = surface.picture
    target = output_folder(folder)
    for file, data in contents.items():
        with atomic_file(target / file) as written:
            written.write(data)
    return WrittenVat([target / file for file in contents], textures.largest, textures.rms, textures.degrees)


def _reduced(group: FrameGroup, triangles: int) -> Segment:
    reduction = reduced(group.positions, group.triangles, triangles)
    return Segment(group.numbers, reduction.frames, reduction.triangles, ())


def _held(numbers: tuple[int, ...], frames: np.ndarray) -> np.ndarray:
    """A frame for every number from the first to the last."""
    return frames[np.searchsorted(numbers, np.arange(numbers[0], numbers[-1] + 1), side="right") - 1]


def _surface(group: FrameGroup, segment: Segment, choice: VatChoice) -> Surface:
    """With a texture where the group has one; engines' shaders read no colors of vertices."""
    appearance = group.appearance
    if appearance is None or not appearance.images or not choice.texture:
        return colored_surface(segment, None, SmallGlb())
    posed = TriangleMesh(group.positions[segment.middle], group.triangles)
    return colored_surface(segment, replace(appearance, mesh=posed), SmallGlb(texture=choice.texture, image=".png", unwrap=choice.unwrap))


def _mesh(first: np.ndarray, triangles: np.ndarray, surface: Surface, arrangement: Arrangement) -> bytes:
    """The first frame as GLB, whose second UV set says where the vertices are in the textures."""
    container, owners = Container(packed=False), surface.owners
    upright = first @ Y_UP.T
    attributes = {
        "POSITION": container.floats(upright[owners]),
        "NORMAL": container.floats(vertex_normals(TriangleMesh(upright, triangles))[owners]),
        "TEXCOORD_0": container.floats(np.zeros((len(owners), 2)) if surface.uvs is None else surface.uvs),
        "TEXCOORD_1": container.floats(arrangement.uvs()[owners]),
    }
    container.entry("meshes", {"primitives": [{"attributes": attributes, "indices": container.triangles(surface.triangles)}]})
    container.content |= {"scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}]}
    return container.finished()


def _bounds(name: str, textures: EncodedFrames, frames: int, frame_rate: float) -> bytes:
    """The JSON that goes with the textures; the last entry is RefMesh's own."""
    content = {
        "os-remap": {"Min": textures.low.tolist(), "Max": textures.high.tolist(), "Frames": frames},
        "animations": {name: {"startFrame": 1, "endFrame": frames, "framerate": frame_rate, "looping": True}},
        "precision": {"largest": textures.largest, "rms": textures.rms, "normal_degrees": textures.degrees},
    }
    return json.dumps(content, indent=4).encode() + b"\n"
