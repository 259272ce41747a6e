"""Presets: the settings that each one changes; everything else keeps its default."""

from __future__ import annotations

PRESET_TITLES = {"draft": "Quick Look", "standard": "Standard", "paper": "Published Method"}  # as the panel shows them
EDITS = ("group_starts", "mesh", "mesh_frame", "apart")  # notes of the user on one sequence, which no preset changes
PRESETS: dict[str, dict[str, object]] = {
    "draft": {"centers": 400, "resolution": 128, "alignment_steps": 3, "fit_rounds": 4, "samples": 10_000},
    "standard": {},
    "paper": {
        "segments": "groups",
        "resolution": 512,
        "mapping": "rbf",
        "reconstruction": "pymeshlab",
        "keypoint_search": "unlimited",
        "fit_rounds": 0,
        "steady_frames": 0,
    },
}
