"""What RefMesh knows of a file format, and the formats that it reads frames from.

A format that holds one mesh in a file is read here, without Blender. Formats that need Blender are in `bridge/formats`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.errors import RefMeshError
from .glb_limits import check_glb
from .obj import parse_obj
from .ply_surface import parse_ply_surface
from .polygons import ParsedMesh
from .stl import parse_stl
from .trimesh_reader import parse_with_trimesh
from .truncation import check_off

if TYPE_CHECKING:
    from ..core.color.appearance import Appearance
    from .texture_files import TextureFiles


@dataclass(frozen=True)
class Format:
    """Everything that distinguishes one file format from another. A direction without a function is not supported.

    name : in options of operators and of the command line.  label : in menus.
    extensions : in lower case, with the dot; the first is the one that is written.
    parse : the bytes of a file that holds one frame -> its mesh. Raises ValueError, saying what is wrong.
    parse_appearance : the bytes of the same file and the files beside it -> its colors; None for a file without colors. A format
    without it holds none that are read.
    shared_vertices : whether triangles can share vertices; where they cannot, equal vertices are merged.
    load : imports a file that holds an animated scene into the present Blender scene.
    write : writes a `bridge.formats.export.Export`; returns the paths of the files.
    contents : what `write` writes, in one line, for menus and `--help`.
    estimate : how large and how good what `write` would write is, in words, in seconds; None for formats without a choice of quality.
    every_frame : `write` writes each frame of a range, so a frame step is refused.
    options : frozen dataclass of the options that `write` takes, each field made by `core.settings.option`.
    unavailable : why this Blender can neither load nor write it; "" when it can.
    """

    name: str
    label: str
    extensions: tuple[str, ...]
    parse: Callable[[bytes], ParsedMesh] | None = None
    parse_appearance: Callable[[bytes, TextureFiles], Appearance | None] | None = None
    shared_vertices: bool = True
    load: Callable[[Path], None] | None = None
    write: Callable[[Any], list[Path]] | None = None
    contents: str = ""
    estimate: Callable[[Any], str] | None = None
    every_frame: bool = False
    options: type | None = None
    unavailable: Callable[[], str] = lambda: ""


def _late(module: str, function: str) -> Callable[..., Any]:
    """A function of a module beside this one, imported when it is called: packages that it needs may be missing."""

    def call(*arguments: Any) -> Any:
        return getattr(import_module(f".{module}", __package__), function)(*arguments)

    return call


OBJ = Format("obj", "Wavefront OBJ", (".obj",), parse_obj, _late("obj_colors", "obj_appearance"))
PLY = Format("ply", "PLY", (".ply",), parse_ply_surface, _late("ply_colors", "ply_appearance"))
STL = Format("stl", "STL", (".stl",), parse_stl, shared_vertices=False)
GLB = Format(
    "glb", "glTF Binary", (".glb",), partial(parse_with_trimesh, kind="glb", check=check_glb), _late("glb_colors", "glb_appearance")
)
OFF = Format("off", "OFF", (".off",), partial(parse_with_trimesh, kind="off", check=check_off))

# By how often captures come in them: where a folder holds as many files of one as of another, the first is taken.
FRAME_FORMATS = {extension: known for known in (OBJ, PLY, STL, GLB, OFF) for extension in known.extensions}


def frame_format(path: Path) -> Format:
    """The format of a file that holds one frame, by its extension in any case. Raises RefMeshError for one that is not read."""
    try:
        return FRAME_FORMATS[path.suffix.lower()]
    except KeyError:
        known = ", ".join(FRAME_FORMATS)
        raise RefMeshError(f"{path}: '{path.suffix}' is not a mesh format that can be read; give one of {known}") from None
