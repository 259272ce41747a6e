"""What other programs read: one function for each format, each file complete or absent."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy

from ...core.errors import RefMeshError
from ...io.files import atomic_file, output_folder
from ...io.pc2 import pc2_shape, read_pc2, write_pc2
from ...io.report import read_report
from ..scene.timeline import timeline
from .choice import Choice
from .stand_ins import cached_stand_ins, morphing_stand_ins
from .velocities import moving

FORMATS = {
    "pc2": "Reference mesh (PLY) and point cache (PC2) of each group",
    "abc": "Alembic, all groups in one file, with velocities",
    "usd": "Universal Scene Description, all groups in one file, with velocities",
    "glb": "glTF binary with one morph target for each frame",
    "ply": "One PLY for each frame",
}
ROOM_PER_SAMPLE, ROOM_PER_TRIANGLE = 36, 60  # bytes in Alembic or USD: position and velocity of a vertex; what comes once; half more
EVERY_FRAME = ("abc", "usd")  # Blender's writers of these know no step


def check_available(kind: str) -> None:
    """Raises RefMeshError when this Blender cannot write the format."""
    options = {"abc": bpy.app.build_options.alembic, "usd": bpy.app.build_options.usd, "glb": hasattr(bpy.types, "EXPORT_SCENE_OT_gltf")}
    if not options.get(kind, True):
        others = ", ".join(name for name in FORMATS if options.get(name, True))
        raise RefMeshError(f"--export {kind}: this Blender cannot write it; choose one of {others}, or use another Blender")


def export_sequence(owner: bpy.types.Object, kind: str, choice: Choice, results: Path, folder: Path) -> list[Path]:
    """Writes the deformed meshes of the sequence object `owner` in the format `kind`; returns the files.

    results : output folder of the run.  folder : where to write; made if need be.
    Raises RefMeshError when the format cannot hold the choice or a file cannot be written.
    """
    if choice.step > 1 and kind in EVERY_FRAME:
        raise RefMeshError(f"--export {kind}: Blender writes every frame of the range; leave out the step, or choose pc2, glb or ply")
    name = bpy.path.clean_name(owner.refmesh.root.name)
    if kind in _COPIES:
        return _COPIES[kind](owner, choice, name, results, output_folder(folder))
    target = output_folder(folder) / f"{name}.{kind}"
    _WRITERS[kind](owner, choice, target, results)
    return [target]


def _copy_caches(owner: bpy.types.Object, choice: Choice, name: str, results: Path, folder: Path) -> list[Path]:
    written = []
    report = read_report(results)
    for index, frames in choice.groups.items():
        group, stem = report["groups"][index], f"{name}_group_{index:03d}"
        cache, target = results / group["playback"], folder / f"{stem}.pc2"
        wanted = [frame - owner.refmesh.groups[index].start for frame in frames]
        written += [_cut(cache, target, wanted), _copy(results / group["reference"], folder / f"{stem}.ply")]
    return written


def _copy_frames(owner: bpy.types.Object, choice: Choice, _name: str, results: Path, folder: Path) -> list[Path]:
    frames = output_folder(folder / "ply")
    numbers = {item.scene_frame: int(item.name) for item in owner.refmesh.frames}
    wanted = {numbers[frame] for within in choice.groups.values() for frame in within if frame in numbers}
    paths = [frame["deformed"] for frame in read_report(results)["frames"] if frame["number"] in wanted]
    return [_copy(results / path, frames / Path(path).name) for path in paths]


def _cut(cache: Path, target: Path, wanted: list[int]) -> Path:
    """The wanted samples of a point cache, whose last one is held; all of them as they are."""
    if not cache.is_file():
        raise RefMeshError(f"{cache}: is missing; run the Deform step again")
    count, points = pc2_shape(cache)
    chosen = {min(index, count - 1) for index in wanted}
    if len(chosen) == count:
        return _copy(cache, target)
    write_pc2(target, (sample for index, sample in enumerate(read_pc2(cache)) if index in chosen), points, len(chosen))
    return target


def _copy(source: Path, target: Path) -> Path:
    if not source.is_file():
        raise RefMeshError(f"{source}: is missing; run the Deform step again")
    with open(source, "rb") as original, atomic_file(target) as copy:
        shutil.copyfileobj(original, copy)
    return target


def _write_alembic(owner: bpy.types.Object, choice: Choice, target: Path, results: Path) -> None:
    _check_room(owner, choice, target)
    with _moving_stand_ins(owner, choice, results), _replacing(target) as partial:
        bpy.ops.wm.alembic_export(
            filepath=str(partial),
            selected=True,
            start=choice.first,
            end=choice.last,
            normals=False,
            uvs=False,
            as_background_job=False,
            check_existing=False,
        )


def _write_usd(owner: bpy.types.Object, choice: Choice, target: Path, results: Path) -> None:
    _check_room(owner, choice, target)
    with _moving_stand_ins(owner, choice, results), _replacing(target) as partial:
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


def _write_gltf(owner: bpy.types.Object, choice: Choice, target: Path, _results: Path) -> None:
    scene = bpy.context.scene
    with morphing_stand_ins(owner, choice), timeline(scene, choice.first, choice.last), _replacing(target) as partial:
        bpy.ops.export_scene.gltf(
            filepath=str(partial),
            export_format="GLB",
            use_selection=True,
            export_animation_mode="SCENE",  # one animation that plays all groups, not one for each
            export_anim_scene_split_object=False,
            export_frame_range=True,
            export_frame_step=choice.step,
            export_materials="NONE",
            check_existing=False,
        )


def _check_room(owner: bpy.types.Object, choice: Choice, target: Path) -> None:
    """Raises RefMeshError when the disk is too small: Blender's writers of Alembic and USD crash on a full one."""
    meshes = {index: owner.refmesh.groups[index].deformed.data for index in choice.groups}
    samples = sum(len(mesh.vertices) for mesh in meshes.values()) * (choice.last - choice.first + 1)
    need = ROOM_PER_SAMPLE * samples + ROOM_PER_TRIANGLE * sum(len(mesh.polygons) for mesh in meshes.values())
    free = shutil.disk_usage(target.parent).free
    if free < need:
        what = f"No space left on device: {need / 1e6:.1f} MB may be needed, {free / 1e6:.1f} MB are free"
        raise RefMeshError(f"{target}: cannot be written ({what})")


@contextmanager
def _moving_stand_ins(owner: bpy.types.Object, choice: Choice, results: Path) -> Iterator[None]:
    """Stand-ins that carry velocities, in a timeline of the frames that are wanted."""
    with (
        cached_stand_ins(owner, choice) as copies,
        timeline(bpy.context.scene, choice.first, choice.last),
        moving(owner, copies, read_report(results), results),
    ):
        yield


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


_COPIES: dict[str, Callable[[bpy.types.Object, Choice, str, Path, Path], list[Path]]] = {"pc2": _copy_caches, "ply": _copy_frames}
_WRITERS: dict[str, Callable[[bpy.types.Object, Choice, Path, Path], None]] = {"abc": _write_alembic, "usd": _write_usd, "glb": _write_gltf}
