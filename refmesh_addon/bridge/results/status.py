"""Whether the results of each step are up to date with the settings of the panel."""

from __future__ import annotations

import json
from dataclasses import dataclass

from ...core.options import label_of, value_label
from ...core.settings import STAGES, flat_fields, setting_names
from ...io.frame_range import format_selection

STEP_NAMES = {
    "tracking": "Track",
    "reference": "Reference",
    "deformation": "Deform",
    "evaluation": "Measure Distance",
    "color": "Color",
}


DEFORMATION = "deformation"


@dataclass(frozen=True)
class StepStatus:
    """kind : "never", "current" or "stale".  text : one line about it.  seconds : that the step took, 0 where unknown."""

    kind: str
    text: str
    seconds: float = 0.0


def used_settings(state, seconds: dict[str, float], settings: dict[str, object], inputs: str = "") -> str:
    """How results were computed, as JSON for `state.results`.

    inputs : `freshness.fingerprint` of them.  seconds : of each step in the last run. A step whose results came from the cache
    keeps its earlier time.
    """
    before = _results(state)
    same = [name for name in seconds if name in state.done and not changes_of(before, name, settings, state.frame_selection)]
    kept = {name: max(seconds[name], before["seconds"].get(name, 0.0)) if name in same else seconds[name] for name in seconds}
    return json.dumps({"settings": settings, "frames": state.frame_selection, "seconds": kept, "inputs": inputs})


def note_other_frames(state, before: list[int], now: list[int]) -> None:
    """Notes that results are of other frames where the list of frames has changed below an unchanged selection.

    before, now : numbers of the selected frames.
    """
    known = known_results(state)
    if known and before != now and known["frames"] == state.frame_selection:
        state.results = json.dumps({**known, "frames": format_selection(before, {*before, *now})})


def step_status(state, stage: str) -> StepStatus:
    """The status of one stage, by the settings that the panel shows now."""
    if stage not in state.done:
        return StepStatus("never", "not run yet")
    results = _results(state)
    changes = changes_of(results, stage, state.settings.to_flat(), state.frame_selection)
    if changes:
        return StepStatus("stale", f"out of date: {'; '.join(changes)}", results["seconds"].get(stage, 0.0))
    return StepStatus("current", "up to date", results["seconds"].get(stage, 0.0))


def first_to_run(state, stage: str) -> str:
    """Name of the step that a job up to `stage` begins with; "" when all are up to date."""
    for name in STAGES[: STAGES.index(stage) + 1]:
        if step_status(state, name).kind != "current":
            return STEP_NAMES[name]
    return ""


def export_note(state) -> str:
    """What an export holds while the meshes are not those that the panel's settings would give; "" when they are."""
    status = step_status(state, DEFORMATION)
    if status.kind != "stale":
        return ""
    return f"Holds the meshes of the last run, as they are in the scene. They are {status.text}"


def _results(state) -> dict:
    known = known_results(state)
    return known if known else {"settings": {}, "frames": "", "seconds": {}}


def known_results(state) -> dict:
    """What `used_settings` has noted; {} where there is nothing, or something else in a scene from elsewhere."""
    try:
        known = json.loads(state.results)
    except (ValueError, RecursionError):
        return {}
    shapes = {"settings": dict, "frames": str, "seconds": dict}
    fits = isinstance(known, dict) and all(isinstance(known.get(name), kind) for name, kind in shapes.items())
    return known if fits and all(isinstance(value, (int, float)) for value in known["seconds"].values()) else {}


def changes_of(results: dict, stage: str, settings: dict[str, object], frames: str) -> list[str]:
    """Describes every difference in what a stage or one before it depends on."""
    changes = [] if results["frames"] == frames else [f"made for frames {results['frames'] or 'all'}, now {frames or 'all'}"]
    names = [name for earlier in STAGES[: STAGES.index(stage) + 1] for name in _dependencies(earlier, settings)]
    values = {name: (results["settings"].get(name), settings.get(name)) for name in names}
    return changes + [_describe_change(name, before, now) for name, (before, now) in values.items() if before != now]


def _describe_change(name: str, before: object, now: object) -> str:
    if name == "apart":
        return "other bodies are marked to be apart"
    item = next(item for item in flat_fields() if item.name == name)
    return f"{label_of(item)} was {value_label(item, before)}, is {value_label(item, now)} now"


def _dependencies(stage: str, settings: dict[str, object]) -> list[str]:
    """Names of the settings that a stage depends on. Tracking that starts anew with each group depends on the groups too."""
    return setting_names(stage) + (["group_size", "group_starts"] if settings.get("tracking") == "group" else [])
