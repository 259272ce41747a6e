"""What other programs read: one function for each format, each file complete or absent."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy

from ..core.check import RefMeshError
from ..io.files import atomic_file, output_folder
from ..io.report import read_report
from .scene import timeline
from .stand_ins import cached_stand_ins, morphing_stand_ins
from .velocities import moving

FORMATS = {
    "pc2": "Reference mesh (PLY) and point cache (PC2) of each group",
    "abc": "Alembic, all groups in one file, with velocities",
    "usd": "Universal Scene Description, all groups in one file, with velocities",
    "glb": "glTF binary with one morph target for each frame",
    "ply": "One PLY for each frame",
}


def check_available(kind: str) -> None:
    """Raises RefMeshError when this Blender cannot write the format."""
    options = {"abc": bpy.app.build_options.alembic, "usd": bpy.app.build_options.usd, "glb": hasattr(bpy.types, "EXPORT_SCENE_OT_gltf")}
    if not options.get(kind, True):
        others = ", ".join(name for name in FORMATS if options.get(name, True))
        raise RefMeshError(f"--export {kind}: this Blender cannot write it; choose one of {others}, or use another Blender")


def export_sequence(owner: bpy.types.Object, kind: str, results: Path, folder: Path) -> list[Path]:
    """Writes the deformed meshes of the sequence object `owner` in the format `kind`; returns the files.

    results : output folder of the run.  folder : where to write; made if need be.
    Raises RefMeshError when there is nothing to export or a file cannot be written.
    """
    if not owner.refmesh.groups or not all(group.deformed for group in owner.refmesh.groups):
        raise RefMeshError(f"{results}: no deformed meshes to export; run the Deform step first")
    name = bpy.path.clean_name(owner.refmesh.root.name)
    if kind in _COPIES:
        return _COPIES[kind](read_report(results), name, results, output_folder(folder))
    target = output_folder(folder) / f"{name}.{kind}"
    _WRITERS[kind](owner, target, results)
    return [target]


def _copy_caches(report: dict, name: str, results: Path, folder: Path) -> list[Path]:
    written = []
    for group in report["groups"]:
        stem = f"{name}_group_{group['index']:03d}"
        written += [_copy(results / group["playback"], folder / f"{stem}.pc2"), _copy(results / group["reference"], folder / f"{stem}.ply")]
    return written


def _copy_frames(report: dict, name: str, results: Path, folder: Path) -> list[Path]:
    frames = output_folder(folder / "ply")
    return [_copy(results / frame["deformed"], frames / Path(frame["deformed"]).name) for frame in report["frames"]]


def _copy(source: Path, target: Path) -> Path:
    if not source.is_file():
        raise RefMeshError(f"{source}: is missing; run the Deform step again")
    with open(source, "rb") as original, atomic_file(target) as copy:
        shutil.copyfileobj(original, copy)
    return target


def _write_alembic(owner: bpy.types.Object, target: Path, results: Path) -> None:
    with _moving_stand_ins(owner, results) as (first, last), _replacing(target) as partial:
        bpy.ops.wm.alembic_export(
            filepath=str(partial),
            selected=True,
            start=first,
            end=last,
            normals=False,
            uvs=False,
            as_background_job=False,
            check_existing=False,
        )


def _write_usd(owner: bpy.types.Object, target: Path, results: Path) -> None:
    with _moving_stand_ins(owner, results), _replacing(target) as partial:
        bpy.ops.wm.usd_export(
            filepath=str(partial),
            selected_objects_only=True,
            export_animation=True,
            export_normals=False,
            export_uvmaps=False,
            export_materials=False,
            convert_world_material=False,
            check_existing=False,
        )


def _write_gltf(owner: bpy.types.Object, target: Path, _results: Path) -> None:
    with morphing_stand_ins(owner), _whole_timeline(owner), _replacing(target) as partial:
        bpy.ops.export_scene.gltf(
            filepath=str(partial),
            export_format="GLB",
            use_selection=True,
            export_animation_mode="SCENE",  # one animation that plays all groups, not one for each
            export_anim_scene_split_object=False,
            export_frame_range=True,
            export_materials="NONE",
            check_existing=False,
        )


@contextmanager
def _moving_stand_ins(owner: bpy.types.Object, results: Path) -> Iterator[tuple[int, int]]:
    """Stand-ins that carry velocities, and the first and last scene frame."""
    with cached_stand_ins(owner) as copies, _whole_timeline(owner) as span, moving(owner, copies, read_report(results), results):
        yield span


@contextmanager
def _whole_timeline(owner: bpy.types.Object) -> Iterator[tuple[int, int]]:
    frames = owner.refmesh.frames
    first, last = frames[0].scene_frame, frames[-1].scene_frame
    with timeline(bpy.context.scene, first, last):
        yield first, last


@contextmanager
def _replacing(target: Path) -> Iterator[Path]:
    """A path beside the target to write to, which becomes the target when the block ends without an error."""
    partial = target.with_name(f"{target.stem}.partial{target.suffix}")  # exporters insist on their extension
    try:
        yield partial
        os.replace(partial, target)
    except (RuntimeError, OSError) as error:
        raise RefMeshError(f"{target}: cannot be written ({_reason(error)})") from error
    finally:
        partial.unlink(missing_ok=True)


def _reason(error: Exception) -> str:
    """The last line of words: an exporter written in Python reports its whole traceback."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip() and not line.startswith("Location: ")]
    return lines[-1] if lines else type(error).__name__


_COPIES: dict[str, Callable[[dict, str, Path, Path], list[Path]]] = {"pc2": _copy_caches, "ply": _copy_frames}
_WRITERS: dict[str, Callable[[bpy.types.Object, Path, Path], None]] = {"abc": _write_alembic, "usd": _write_usd, "glb": _write_gltf}
