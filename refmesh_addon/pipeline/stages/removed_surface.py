"""What was left out of the frames of an open take: its shares in the report, and the surface itself as PLY, to be looked at."""

from __future__ import annotations

from ...core.geometry.mesh import submesh, triangle_areas
from ...io.files import output_folder
from ...io.ply import write_ply
from ..session.context import Context

FOLDER = "removed"  # in the output folder


def write_removed(context: Context, frame: int) -> dict[str, float]:
    """Writes what was left out of a frame, by its index, where there is anything.

    Returns the share of the frame's area of each kind, as fields of `FrameReport`; nothing for closed takes.
    """
    if context.frames.take is None:
        return {}
    mesh, artifacts = context.frames.mesh(frame), context.frames.artifacts(frame)
    if artifacts.any.any():
        output_folder(context.output / FOLDER)
        write_ply(context.claim(removed_path(context.numbers[frame])), submesh(mesh, artifacts.any)[0])
    return artifacts.shares(triangle_areas(mesh))


def remove_stale_removed(context: Context) -> None:
    """Removes what earlier runs left out and this one does not."""
    numbers = [entry.number for entry in context.report.frames if (entry.skirts or 0) + (entry.flying or 0) + (entry.frayed or 0) > 0]
    context.remove_stale(f"{FOLDER}/frame_*.ply", keep=[removed_path(number) for number in numbers])


def removed_path(number: int) -> str:
    """The surface that was left out of a frame, by its number; relative to the output folder."""
    return f"{FOLDER}/frame_{number:04d}.ply"
