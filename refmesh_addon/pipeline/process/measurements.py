"""What the stages took last on this machine, kept in the user's cache folder for the forecasts of later jobs."""

from __future__ import annotations

import contextlib
import json
import os
import sys
from dataclasses import asdict
from pathlib import Path

from ...core.errors import RefMeshError
from ...core.settings import STAGES
from ...io.files import output_folder, write_json
from ...io.regular_files import read_json
from ..session.job import COLOR, STAGE_WEIGHTS, JobSpec
from .forecast import STEPS, UNMEASURED, StageTime

PLACE_VARIABLE = "REFMESH_MEASUREMENTS"  # of the environment: a file to use instead
MOST = 200  # entries that are kept


def stage_times(spec: JobSpec) -> dict[str, StageTime]:
    """Of each stage of a job: as measured with its settings, else with other settings, else a rough share of a whole job."""
    known = _read()
    times = {stage: _stage_time(known, stage, spec) for stage in spec.timed_stages}
    return without_color(times) if spec.settings.color.texture == "off" else times


def without_color(times: dict[str, StageTime]) -> dict[str, StageTime]:
    """The times of a job whose frames get no colors."""
    return {**times, COLOR: StageTime(0.0, measured=True)} if COLOR in times else times


def remember(spec: JobSpec, stage: str, taken: StageTime) -> None:
    """Keeps what a stage took; where nothing can be kept, later jobs know less."""
    known = _read()
    for key in (_key(stage, spec), stage):
        known.pop(key, None)  # so that it becomes the newest
        known[key] = {"seconds": taken.seconds, "curve": list(taken.curve)}
    with contextlib.suppress(OSError, RefMeshError):
        output_folder(measurements_path().parent)
        write_json(measurements_path(), dict(list(known.items())[-MOST:]))


def measurements_path() -> Path:
    """The file in the folder that the system has for such data."""
    if PLACE_VARIABLE in os.environ:
        return Path(os.environ[PLACE_VARIABLE])
    home = Path(os.path.expanduser("~"))
    if sys.platform == "win32":
        folder = Path(os.environ.get("LOCALAPPDATA", home))
    elif sys.platform == "darwin":
        folder = home / "Library" / "Caches"
    else:
        folder = Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")
    return folder / "refmesh" / "stage_times.json"


def _stage_time(known: dict, stage: str, spec: JobSpec) -> StageTime:
    for key, measured in ((_key(stage, spec), True), (stage, False)):
        with contextlib.suppress(KeyError, TypeError, ValueError):
            seconds, curve = float(known[key]["seconds"]), tuple(map(float, known[key]["curve"]))
            if seconds >= 0 and len(curve) == STEPS + 1:
                return StageTime(seconds, curve, measured)
    return StageTime(UNMEASURED * STAGE_WEIGHTS[stage])


def _key(stage: str, spec: JobSpec) -> str:
    """Of a stage with its settings."""
    settings = asdict(getattr(spec.settings, stage)) if stage in STAGES else {}
    return f"{stage} {json.dumps(settings, sort_keys=True)}"


def _read() -> dict:
    try:
        known = read_json(measurements_path())
    except (OSError, ValueError):
        return {}
    return known if isinstance(known, dict) else {}
