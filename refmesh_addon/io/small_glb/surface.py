"""How a segment looks: its texture on a layout of its own, or colors of its vertices, and the vertices as these need them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.color.appearance import Appearance
from ...core.color.transfer import transferred_colors, transferred_texture
from ...core.errors import RefMeshError
from ...core.geometry.borders import boundary_edges
from ...core.types import FrozenArrays, TriangleMesh
from ..images import encoded, images_available
from .choice import SmallGlb
from .container import Container
from .segment import Segment
from .triangle_order import packing_order

WEBP = "EXT_texture_webp"
UNLIT = "KHR_materials_unlit"  # a capture's colors hold the light that it was taken in
MIME_TYPES = {".webp": "image/webp", ".png": "image/png", ".jpg": "image/jpeg"}
PLAIN = {"baseColorFactor": [0.8, 0.8, 0.8, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.8}  # of a mesh without colors
WHOLE = (1 << 16) - 1  # whole number of a texture coordinate or a color of 1
LEAST_TEXTURE = 64  # pixels along a side
LINEAR_UNTIL = 0.04045  # of the sRGB curve (IEC 61966-2-1)


@dataclass(frozen=True)
class Surface(FrozenArrays):
    """What all runs of a segment share.

    owners : (W,) vertex of the segment that each vertex of the file shows; several show one at a seam of the layout.
    triangles : (T, 3) of the W vertices.  uvs : (W, 2) from the upper left, None without a texture.
    colors : (W, 3) linear, 0 to 1, None without colors of vertices.  picture : encoded, None without a texture.  kind : its MIME type.
    """

    owners: np.ndarray
    triangles: np.ndarray
    uvs: np.ndarray | None = None
    colors: np.ndarray | None = None
    picture: bytes | None = None
    kind: str = ""


def colored_surface(segment: Segment, appearance: Appearance | None, choice: SmallGlb) -> Surface:
    """The surface of a segment.  appearance : of its middle frame, before it was reduced; None leaves colors out.

    Raises RefMeshError for a texture where Pillow is missing.
    """
    count = segment.frames.shape[1]
    if appearance is None:
        return Surface(np.arange(count), segment.triangles)
    mesh = TriangleMesh(segment.frames[segment.middle], segment.triangles)
    if not appearance.images:
        return Surface(np.arange(count), segment.triangles, colors=linear(transferred_colors(appearance, mesh) / 255.0))
    if not images_available():
        raise RefMeshError("textures need the Python package 'pillow', which is not installed; export without a texture")
    layout = choice.unwrap(mesh)
    picture = transferred_texture(appearance, mesh, layout, texture_size(appearance, choice.texture))
    owners = np.empty(len(layout.uvs), dtype=np.int64)
    owners[layout.triangles] = segment.triangles
    triangles, order = packing_order(layout.triangles, len(layout.uvs))
    uvs = np.clip(layout.uvs[order] * [1.0, -1.0] + [0.0, 1.0], 0.0, 1.0)
    return Surface(owners[order], triangles, uvs, picture=encoded(picture, choice.image), kind=MIME_TYPES[choice.image])


def texture_size(appearance: Appearance, greatest: int) -> int:
    """Pixels along a side: a power of two up to the greatest, and no larger than the picture that there is."""
    return max(LEAST_TEXTURE, 1 << (min(appearance.size, greatest).bit_length() - 1))


def linear(colors: np.ndarray) -> np.ndarray:
    """sRGB colors of any shape, 0 to 1, as amounts of light, which glTF holds in vertices."""
    return np.where(colors <= LINEAR_UNTIL, colors / 12.92, ((colors + 0.055) / 1.055) ** 2.4)


def surface_attributes(container: Container, surface: Surface) -> dict[str, int]:
    """Accessors of what is alike in all frames."""
    return {
        name: container.vertices([np.rint(WHOLE * values).astype(np.uint16)], normalized=True)[0]
        for name, values in (("TEXCOORD_0", surface.uvs), ("COLOR_0", surface.colors))
        if values is not None
    }


def material(container: Container, segment: Segment, surface: Surface) -> int:
    """Number of the segment's material: its colors without light, or a plain one."""
    is_open = len(boundary_edges(TriangleMesh(segment.frames[0], segment.triangles))) > 0
    sides = {"doubleSided": True} if is_open else {}
    if surface.picture is None and surface.colors is None:
        return container.entry("materials", {"pbrMetallicRoughness": PLAIN, **sides})
    container.extend(UNLIT)
    shading: dict = {"metallicFactor": 0.0, "roughnessFactor": 1.0}  # for readers without the extension
    if surface.picture is not None:
        shading["baseColorTexture"] = {"index": _texture(container, surface.picture, surface.kind)}
    return container.entry("materials", {"pbrMetallicRoughness": shading, "extensions": {UNLIT: {}}, **sides})


def _texture(container: Container, picture: bytes, kind: str) -> int:
    image = container.entry("images", {"bufferView": container.raw(picture), "mimeType": kind})
    if kind != MIME_TYPES[".webp"]:
        return container.entry("textures", {"source": image})
    container.extend(WEBP, required=True)
    return container.entry("textures", {"extensions": {WEBP: {"source": image}}})
