"""Shows in the scene what the output folder holds: centers, reference meshes, deformed meshes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import bpy
import numpy as np

from ...core.settings import STAGES, flat_fields
from ...io.frame_range import format_ranges, format_selection, parse_ranges
from ..scene.markers import show_markers
from ..scene.materials import fade_by
from ..scene.paths import absolute_path, stored_path
from ..scene.visibility_nodes import TRANSPARENCY, play_visibility
from .centers import show_centers
from .freshness import fingerprint
from .groups import arrange, deformed_material, place_results, remove_deformed, resize_groups, show_deformed, show_in_turn, show_reference
from .own_mesh import find_own_mesh
from .reading import Results, centers_playback
from .status import used_settings
from .textures import show_textures
from .visibility import present_kinds, show_newest

SIDE_STEP = 1.25  # distance of source, centers, reference and result, in widths of the whole motion: they never overlap

SceneUpdate = Callable[[bpy.types.Object], str | None]  # may return what a person is to be told


def known_frames(owner: bpy.types.Object) -> dict[int, int]:
    """Number of each frame of a sequence -> the scene frame that shows it."""
    return {int(frame.name): frame.scene_frame for frame in owner.refmesh.frames}


def scene_updates(results: Results, kinds: set[str] | None = None) -> Iterator[SceneUpdate]:
    """Functions that show the results one after the other, each in some hundredths of a second.

    kinds : of objects that the sequence had before the run, where some of its results are shown already.
    Each takes the sequence object, which the caller looks up anew every time, since an undo in between replaces it.
    """
    groups, before, carried = results.report["groups"], set(kinds or ()), {}
    if kinds is None:
        yield lambda owner: before.update(present_kinds(owner))
    yield lambda owner: place_results(owner, results.offset)
    yield lambda owner: _set_side_step(owner, results)
    yield lambda owner: _show_centers(owner, results)
    yield lambda owner: resize_groups(owner, len(groups))
    yield lambda owner: find_own_mesh(owner, str(results.report["settings"].get("mesh") or "")) or None
    for index, group in enumerate(groups):
        yield partial(_show_reference, results=results, index=index, carried=carried)
        if group.get("playback"):
            yield partial(_show_deformed, results=results, index=index, carried=carried)
    if not all(group.get("playback") for group in groups):
        yield remove_deformed
    yield from (partial(show_in_turn, index=index) for index in range(len(groups)))
    yield lambda owner: _update_state(owner, results)
    yield lambda owner: show_newest(owner, before)
    yield _show_current_frame
    yield lambda _: _carried_message(carried)


def _show_centers(owner: bpy.types.Object, results: Results) -> None:
    report = results.report
    first = known_frames(owner)[report["sequence"]["numbers"][0]]
    cache = centers_playback(results.folder, report)
    show_centers(owner, results.positions[0], cache, first, results.spacing, results.attributes)


def _set_side_step(owner: bpy.types.Object, results: Results) -> None:
    """Objects that stand side by side are placed anew where their distance has changed; those that were moved by hand stay otherwise."""
    state, step = owner.refmesh, SIDE_STEP * float(np.ptp(results.positions[..., 0]))
    if not np.isclose(state.side_step, step):
        state.side_step = step
        if state.arrangement == "SIDE":
            arrange(owner)


def _show_reference(owner: bpy.types.Object, results: Results, index: int, carried: dict[str, list[int]]) -> None:
    group, entry = owner.refmesh.groups[index], results.report["groups"][index]
    group.start, group.reason = known_frames(owner)[entry["frames"][0]], entry.get("reason") or ""
    _note(carried, show_reference(owner, index, results.meshes[index]), index)


def _show_deformed(owner: bpy.types.Object, results: Results, index: int, carried: dict[str, list[int]]) -> None:
    cache = results.folder / results.report["groups"][index]["playback"]
    _note(carried, show_deformed(owner, index, results.meshes[index], cache), index)
    picture, group = results.report["groups"][index].get("visibility"), owner.refmesh.groups[index]
    play_visibility(group.deformed, results.folder / picture if picture else None, group.start)
    if picture:
        fade_by(deformed_material(), TRANSPARENCY)


def _note(carried: dict[str, list[int]], kinds: str, index: int) -> None:
    if kinds and index not in carried.setdefault(kinds, []):
        carried[kinds].append(index)


def _carried_message(carried: dict[str, list[int]]) -> str:
    """What a person is told after the topology of some groups has changed; "" when none has, or nothing was on their objects."""
    parts = [f"{kinds} of {'group' if len(indices) == 1 else 'groups'} {format_ranges(indices)}" for kinds, indices in carried.items()]
    return f"the topology has changed; carried over by nearest surface: {'; '.join(parts)}" if parts else ""


def _show_current_frame(owner: bpy.types.Object) -> None:
    """Evaluates the new keyframes, so that only the group of the current frame is visible."""
    for scene in owner.users_scene:
        scene.frame_set(scene.frame_current)


def _update_state(owner: bpy.types.Object, results: Results) -> None:
    state, report = owner.refmesh, results.report
    if absolute_path(owner, state.output) != results.folder:
        state.output = stored_path(results.folder)
    show_markers(owner, [group["frames"] for group in report["groups"]])
    measured = {str(frame["number"]): frame["source_to_deformed"]["mean"] for frame in report["frames"] if frame.get("source_to_deformed")}
    _set_of_frames(state, "distance", measured)
    _set_of_frames(state, "overstretched", {str(frame["number"]): frame.get("overstretched", 0.0) for frame in report["frames"]})
    _set_of_frames(state, "bad", {str(entry["frame"]): _bad_note(entry) for entry in report.get("bad_frames", [])})
    state.bodies = "\n".join(_body_lines(report.get("bodies", [])))
    _show_places(state, results)
    reached = [True, bool(report["groups"]), bool(report["frames"]), bool(measured), "color" in report["seconds"]]
    known = {setting.name for setting in flat_fields()}
    settings = {name: value for name, value in report["settings"].items() if name in known}
    state.frame_selection = _selection(state, report["sequence"]["numbers"])
    state.results = used_settings(state, report["seconds"], settings, fingerprint(owner, results.folder))
    state.settings.assign(settings)
    state.missing = ""
    if state.heat_map:
        state.heat_map = bool(measured)  # draws the errors anew
    show_textures(owner, results.folder, report)
    state.done = {stage for stage, is_reached in zip(STAGES, reached, strict=True) if is_reached}


def _set_of_frames(state, name: str, values: dict[str, float]) -> None:
    """Sets a property of each frame that has a value, and none of the others."""
    for frame in state.frames:
        if frame.name in values:
            setattr(frame, name, values[frame.name])
        else:
            frame.property_unset(name)


def _body_lines(bodies: list[dict]) -> list[str]:
    """What the panel says of the bodies that the take shows; nothing of one that is alone."""
    lines = []
    for number, body in enumerate(bodies if len(bodies) > 1 else (), 1):
        first, last = body["frames"]
        gap = f"widest gap in frame {first}" if first == last else f"apart in frames {first}-{last}"
        shown = f"moves apart in frames {first}-{last}" if body["by_motion"] else gap
        lines.append(f"Body {number}: {body['centers']} centers, {shown}")
    return lines


def _bad_note(entry: dict) -> str:
    """What the panel says of a bad frame."""
    done = f"moves from {entry['before']} to {entry['after']}" if entry["bridged"] else f"holds {entry['before']}"
    return f"{entry['reason']}; {done}"


def _show_places(state, results: Results) -> None:
    """The list of places at which frames are far from their sources, the worst first."""
    state.places.clear()
    for place in results.report.get("far_places", []):
        item = state.places.add()
        item.name, item.kind, item.distance = str(place["frame"]), place["kind"], place["distance"]
        item.position = np.array(place["position"]) - results.offset


def _selection(state, numbers: list[int]) -> str:
    """The selection that gives these numbers; the present one is kept when it already does."""
    everything = [int(frame.name) for frame in state.frames]
    chosen = parse_ranges(state.frame_selection)
    if numbers == [number for number in everything if not chosen or any(number in item for item in chosen)]:
        return state.frame_selection
    return format_selection(numbers, everything)
