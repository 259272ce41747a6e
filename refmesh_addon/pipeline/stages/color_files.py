"""What is written and said of colors: an image sequence, masks, steady textures and layouts; or meshes with vertex colors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...core.evaluation.psnr import PSNR_CEILING
from ...io.files import atomic_file, output_folder, write_npz
from ...io.ply import write_ply
from ...io.report import COLORED_FOLDER, TEXTURE_FOLDER
from ...io.sequence import timeline_frame
from ..session.context import Context
from ..session.layouts import PROJECTED, SMART_UV_ABF
from ..session.painted import record_texture, rename_painted
from .color import EXTENSIONS, ColoredSequence, applied
from .color_units import GroupLayout, finished
from .deformation import DeformedSequence
from .groups import FrameGroup

FALLBACKS = {  # source of a layout -> what is said of it
    SMART_UV_ABF: "xatlas is missing, failed or took too long; Blender's Smart UV Project, unwrapped angle-based,",
    PROJECTED: "neither xatlas nor Blender gave a layout; a plain projection",
}


def write_colors(context: Context, deformed: DeformedSequence, colored: ColoredSequence | None) -> None:
    """Writes all files of the stage, notes them in the report, and removes those of earlier runs."""
    kept: list[str] = []
    for name, free in rename_painted(context.output).items():
        context.warn(f"{name} has been changed since it was written; it is kept as {free}")
    if colored is not None:
        output_folder(context.output / (TEXTURE_FOLDER if colored.size else COLORED_FOLDER))
        for group in colored.groups:
            kept += _write_group(context, colored, group) if colored.size else _write_colored(context, deformed, colored, group)
    for pattern in (f"{TEXTURE_FOLDER}/*.*", f"{COLORED_FOLDER}/*.ply"):
        context.remove_stale(pattern, keep=kept)


def _write_group(context: Context, colored: ColoredSequence, group: FrameGroup) -> list[str]:
    layout = colored.layouts[group.index]
    if layout.source in FALLBACKS:
        context.warn(f"group {group.index}: {FALLBACKS[layout.source]} is used; it has {layout.quality.charts} charts")
    names = {name: f"{TEXTURE_FOLDER}/group_{group.index:03d}_{name}" for name in ("layout.npz", "steady.png", "steady_mask.png")}
    write_npz(context.claim(names["layout.npz"]), {"uvs": layout.layout.uvs, "triangles": layout.layout.triangles})
    steady = colored.steady_files[group.index]
    record_texture(context.output, names["steady.png"], steady.image.tobytes())
    _write(context, names["steady.png"], steady.image)
    _write(context, names["steady_mask.png"], steady.mask)
    context.report.groups[group.index] = replace(
        context.report.groups[group.index], layout=names["layout.npz"], texture=names["steady.png"], **_figures(layout)
    )
    return [*names.values(), *(name for frame in group.frames for name in _write_frame(context, colored, group, frame))]


def _figures(layout: GroupLayout) -> dict[str, object]:
    quality = layout.quality
    figures = {"layout_charts": quality.charts, "layout_stretch": quality.stretch, "layout_area": quality.area_used}
    return {"layout_source": layout.source, **figures}


def _write_frame(context: Context, colored: ColoredSequence, group: FrameGroup, frame: int) -> list[str]:
    """Pictures are numbered as the scene's frames, so that an image sequence plays as it is; a missing frame's is that before it."""
    files, extension = colored.files[frame], EXTENSIONS[context.settings.color.texture_format]
    first, *rest = _scene_frames(context, frame)
    image, mask = (f"{TEXTURE_FOLDER}/{name}" for name in (f"frame_{first:04d}{extension}", f"mask_{first:04d}.png"))
    repeated = [f"{TEXTURE_FOLDER}/frame_{number:04d}{extension}" for number in rest]
    for name in (image, *repeated):
        _write(context, name, files.image)
    _write(context, mask, files.mask)
    error = colored.baked[group.index, frame].error
    psnr = {} if error is None else {
        "color_psnr": min(error.psnr, PSNR_CEILING),
        "color_ssim": error.ssim,
        "picture_psnr": min(error.picture_psnr, PSNR_CEILING),
        "picture_ssim": error.picture_ssim,
    }
    _note(context, frame, colored, texture=image, texture_mask=mask, filled=files.filled, **psnr)
    _note_held(context, frame, mask, extension)
    return [image, mask, *repeated]


def _scene_frames(context: Context, frame: int) -> list[int]:
    """Frames of the scene that show a frame: its own, and those of missing frames behind it."""
    first = timeline_frame(context.report.sequence, context.numbers[0])
    return [first + position for position, shown in enumerate(context.shown) if shown == frame]


def _write_colored(context: Context, deformed: DeformedSequence, colored: ColoredSequence, group: FrameGroup) -> list[str]:
    names = []
    for frame in group.frames:
        name = f"{COLORED_FOLDER}/frame_{context.numbers[frame]:04d}.ply"
        gains = applied(context, colored.gains[frame])
        baked, steady = colored.baked[group.index, frame], colored.steady[group.index]
        colors = finished(baked, gains[0], steady, gains[1])
        opaque = np.full((len(colors), 1), 255, np.uint8)
        write_ply(context.claim(name), deformed.mesh(group, frame), np.hstack([colors, opaque]))
        _note(context, frame, colored, colored=name, filled=float((~baked.seen & steady.seen).mean()))
        names.append(name)
    return names


def _note_held(context: Context, frame: int, mask: str, extension: str) -> None:
    """Bad frames after a frame have its pictures."""
    held = {bad.frame for bad in context.left_out.frames if bad.before == context.numbers[frame]}
    for row, entry in enumerate(context.report.frames):
        if entry.number in held:
            image = f"{TEXTURE_FOLDER}/frame_{timeline_frame(context.report.sequence, entry.number):04d}{extension}"
            context.report.frames[row] = replace(entry, texture=image, texture_mask=mask)


def _note(context: Context, frame: int, sequence: ColoredSequence, **entries) -> None:
    gain = tuple(sequence.gains[frame].tolist()) if context.settings.color.exposure == "even" else None
    row = [entry.number for entry in context.report.frames].index(context.numbers[frame])
    context.report.frames[row] = replace(context.report.frames[row], gain=gain, **entries)


def _write(context: Context, name: str, data: np.ndarray) -> None:
    with atomic_file(context.claim(name)) as file:
        file.write(data.tobytes())
