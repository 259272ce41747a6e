"""A mesh of the user's own in place of the reconstructed one, for the run of frames that holds the frame it was made over."""

from __future__ import annotations

from ...core.errors import RefMeshError
from ...core.reference.own_mesh import check_own_mesh, check_structure
from ...core.settings import OVER_REFERENCE
from ...core.types import TriangleMesh
from ...io.frame_range import format_ranges
from ...io.meshes import parse_mesh, read_bytes
from ..session.cache import digest
from ..session.context import Context


def own_mesh_frame(context: Context) -> int | None:
    """Index of the frame that the mesh was made over, the first for the reference mesh; None where no mesh is given.

    Raises RefMeshError for a frame that is not there.
    """
    settings, numbers = context.settings.reference, context.numbers
    if not settings.mesh:
        return None
    if settings.mesh_frame in (-1, OVER_REFERENCE):
        return 0
    if settings.mesh_frame not in numbers:
        advice = context.left_out.advice(settings.mesh_frame)
        raise RefMeshError(f"--mesh-frame {settings.mesh_frame} is not part of the job; it has frames {format_ranges(numbers)}{advice}")
    return numbers.index(settings.mesh_frame)


def over_reference(context: Context) -> bool:
    """Whether the mesh was made over the reference mesh, not over a frame."""
    return context.settings.reference.mesh_frame == OVER_REFERENCE


def own_mesh(context: Context) -> TriangleMesh:
    """The mesh of `--mesh`, triangulated, its vertices in their order. Raises RefMeshError when it cannot be read."""
    path = context.settings.reference.mesh
    return parse_mesh(read_bytes(path), path)


def own_mesh_key(context: Context) -> str:
    """Of the mesh and what it was made over."""
    return digest(read_bytes(context.settings.reference.mesh), "reference" if over_reference(context) else own_mesh_frame(context))


def check_own(context: Context) -> None:
    """Raises RefMeshError, saying why, for a mesh that was not made over the frame that is named, or that cannot be deformed."""
    frame = own_mesh_frame(context)
    if frame is None:
        return
    if context.settings.tracking.tracking == "group":
        raise RefMeshError("--mesh needs centers that are followed through the whole take: take --tracking sequence")
    name = "the reference mesh" if over_reference(context) else f"frame {context.numbers[frame]}"
    try:
        if over_reference(context):  # whether it lies there shows once the frames are aligned
            check_structure(own_mesh(context))
        else:
            check_own_mesh(own_mesh(context), context.frames.surface(frame))
    except ValueError as error:
        raise RefMeshError(f"{context.settings.reference.mesh}, over {name}: {error}") from error
