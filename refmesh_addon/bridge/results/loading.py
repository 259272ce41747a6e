"""Shows in the scene what the output folder holds: centers, reference meshes, deformed meshes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from zipfile import BadZipFile

import bpy
import numpy as np

from ...core.errors import RefMeshError
from ...core.findings import CENTER_ATTRIBUTES
from ...core.settings import Settings, flat_fields
from ...io.files import CENTERS_NAME, read_npz
from ...io.frame_range import as_choice, parse_ranges
from ...io.ply import read_surface
from ...io.preview import PreviewMesh
from ...io.report import read_report
from ..scene.markers import show_markers
from ..scene.playback import check_cache
from .centers import show_centers, spacing
from .groups import arrange, remove_deformed, resize_groups, show_deformed, show_in_turn, show_reference
from .heat_map import switch_heat_map
from .status import used_settings

STAGES = tuple(stage.name for stage in fields(Settings))
SIDE_STEP = 1.25  # distance of source, centers, reference and result, in widths of the whole motion: they never overlap

Part = Callable[[bpy.types.Object], None]


@dataclass(frozen=True)
class Results:
    """What an output folder holds, read and checked.

    positions : (F, C, 3) centers, `spacing` apart.  attributes : of each center.  meshes : of each group.
    """

    folder: Path
    report: dict
    positions: np.ndarray
    spacing: float
    attributes: dict[str, np.ndarray]
    meshes: list[PreviewMesh]


def known_frames(owner: bpy.types.Object) -> dict[int, int]:
    """Number of each frame of a sequence -> the scene frame that shows it."""
    return {int(frame.name): frame.scene_frame for frame in owner.refmesh.frames}


def read_results(folder: Path, known: dict[int, int]) -> Results:
    """All that `parts` shows; touches nothing of Blender, so that a thread may do it.

    known : number of each frame of the sequence -> scene frame. Raises RefMeshError, naming the file, when results are missing,
    broken, or of another sequence.
    """
    report = read_report(folder)
    strangers = [number for number in report["sequence"]["numbers"] if number not in known]
    if strangers:
        raise RefMeshError(
            f"{folder / 'report.json'}: has frame {strangers[0]}, which this sequence has not; choose the results of this sequence"
        )
    centers = read_centers(folder)
    positions = centers["positions"]
    check_cache(folder / report["centers_playback"], positions.shape[1])
    apart = report["tracking"].get("center_spacing") or spacing(positions[0])
    attributes = {name: centers[name] for name in CENTER_ATTRIBUTES if name in centers}
    return Results(folder, report, positions, apart, attributes, _read_references(folder, report["groups"]))


def parts(results: Results) -> Iterator[Part]:
    """The work of showing results, cut into pieces of some hundredths of a second. Each is called with the sequence object.

    It is asked for anew for every piece, so that an undo in between does no harm.
    """
    groups = results.report["groups"]
    yield lambda owner: _show_centers(owner, results)
    yield lambda owner: resize_groups(owner, len(groups))
    for index, group in enumerate(groups):
        yield partial(_show_reference, results=results, index=index)
        if group.get("playback"):
            yield partial(_show_deformed, results=results, index=index)
    if not all(group.get("playback") for group in groups):
        yield remove_deformed
    yield from (partial(show_in_turn, index=index) for index in range(len(groups)))
    yield lambda owner: _note_state(owner, results)
    yield _show_current_frame


def _show_centers(owner: bpy.types.Object, results: Results) -> None:
    report = results.report
    first = known_frames(owner)[report["sequence"]["numbers"][0]]
    cache = results.folder / report["centers_playback"]
    show_centers(owner, results.positions[0], cache, first, results.spacing, results.attributes)


def _show_reference(owner: bpy.types.Object, results: Results, index: int) -> None:
    owner.refmesh.groups[index].start = known_frames(owner)[results.report["groups"][index]["frames"][0]]
    show_reference(owner, index, results.meshes[index])


def _show_deformed(owner: bpy.types.Object, results: Results, index: int) -> None:
    show_deformed(owner, index, results.meshes[index], results.folder / results.report["groups"][index]["playback"])


def _show_current_frame(owner: bpy.types.Object) -> None:
    """What was keyed takes effect: only the group of the current frame is seen."""
    for scene in owner.users_scene:
        scene.frame_set(scene.frame_current)


def read_centers(folder: Path) -> dict[str, np.ndarray]:
    """What tracking left in an output folder: `frames`, `positions` and the attributes of the centers. Raises RefMeshError."""
    path = folder / CENTERS_NAME
    try:
        arrays = read_npz(path)
        if "frames" not in arrays or arrays["positions"].ndim != 3:
            raise ValueError("it holds no centers")
        return arrays
    except (OSError, ValueError, KeyError, BadZipFile) as error:
        raise RefMeshError(f"{path}: cannot be read ({error}); run the steps again") from error


def _read_references(folder: Path, groups: list[dict]) -> list[PreviewMesh]:
    meshes = [PreviewMesh.of(read_surface(folder / group["reference"])) for group in groups]
    for group, mesh in zip(groups, meshes):
        if group.get("playback"):
            check_cache(folder / group["playback"], len(mesh.vertices))
    return meshes


def _note_state(owner: bpy.types.Object, results: Results) -> None:
    state, report = owner.refmesh, results.report
    if Path(bpy.path.abspath(state.output)) != results.folder:
        state.output = str(results.folder)
    state.side_step = SIDE_STEP * float(np.ptp(results.positions[..., 0]))
    arrange(owner)
    show_markers(owner, [group["frames"] for group in report["groups"]])
    measured = {str(frame["number"]): frame["source_to_deformed"]["mean"] for frame in report["frames"] if frame.get("source_to_deformed")}
    for frame in state.frames:
        if frame.name in measured:
            frame.distance = measured[frame.name]
        else:
            frame.property_unset("distance")
    reached = [True, bool(report["groups"]), bool(report["frames"]), bool(measured)]
    known = {setting.name for setting in flat_fields()}
    settings = {name: value for name, value in report["settings"].items() if name in known}
    state.frame_selection = _selection(state, report["sequence"]["numbers"])
    state.results = used_settings(state, report["seconds"], settings)
    state.settings.assign(settings)
    state.missing = ""
    state.heat_map = state.heat_map and bool(measured)
    switch_heat_map(owner)
    state.done = {stage for stage, there in zip(STAGES, reached, strict=True) if there}


def _selection(state, numbers: list[int]) -> str:
    """The choice of frames that gives these numbers; the one that stands there already where it does."""
    everything = [int(frame.name) for frame in state.frames]
    chosen = parse_ranges(state.frame_selection)
    if numbers == [number for number in everything if not chosen or any(number in item for item in chosen)]:
        return state.frame_selection
    return as_choice(numbers, everything)
