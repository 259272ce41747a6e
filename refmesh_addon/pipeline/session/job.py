"""The job of one run: its input, output and settings, as they are passed between processes."""

from __future__ import annotations

import json
from dataclasses import dataclass, field

from ...core.errors import RefMeshError
from ...core.settings import STAGES, Settings

CACHE_FOLDER = "cache"  # in the output folder; nothing of the user's lies in it
CHECK = "sequence"  # reads the frames only; no stage depends on it
TRACKING, REFERENCE, DEFORMATION, EVALUATION, COLOR = STAGES
# Of the time of a whole run, roughly, for forecasts on a machine where nothing was measured yet.
STAGE_WEIGHTS = {CHECK: 1.0, TRACKING: 0.15, REFERENCE: 0.2, DEFORMATION: 0.4, EVALUATION: 0.25, COLOR: 0.7}
_TYPES = {
    **dict.fromkeys(("source", "output", "frames", "until", "scheduler"), str),
    **{"resume": bool, "settings": dict, "warnings": list, "notes": list},
}


@dataclass(frozen=True)
class JobSpec:
    """One run of the pipeline.

    source : folder, file or pattern, as `find_sequence` takes it.  output : folder.  frames : "6-10,14" or "" for all.
    until : the last of STAGES to run, or CHECK.  resume : use what earlier runs left in the cache of the output folder.
    warnings : known before the run starts; reported with its own.  notes : findings of the scene, such as an unusual size, that a
    check lists with its own.  scheduler : address of a Dask scheduler whose workers share the work; "" for this machine alone.
    """

    source: str
    output: str
    frames: str = ""
    settings: Settings = field(default_factory=Settings)
    until: str = STAGES[-1]
    resume: bool = True
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    scheduler: str = ""

    def __post_init__(self):
        if self.until not in (CHECK, *STAGES):
            raise RefMeshError(f"'{self.until}' is not a stage: choose one of {', '.join((CHECK, *STAGES))}")

    @property
    def stages(self) -> tuple[str, ...]:
        """The stages to run, in order."""
        return (CHECK,) if self.until == CHECK else STAGES[: STAGES.index(self.until) + 1]

    @property
    def timed_stages(self) -> tuple[str, ...]:
        """Those that take time: a job that ends with the deformation also measures it, to see how long one mesh serves."""
        reviewed = self.settings.reference.segments == "long" and self.stages[-1] == DEFORMATION
        return (*self.stages, EVALUATION) if reviewed else self.stages

    def to_json(self) -> str:
        """The job as JSON text, on any machine read back by `from_json`."""
        plain = {name: getattr(self, name) for name in ("source", "output", "frames", "until", "resume", "warnings", "notes", "scheduler")}
        return json.dumps({**plain, "settings": self.settings.to_flat()}, indent=2, ensure_ascii=False)

    @classmethod
    def from_json(cls, text: str) -> JobSpec:
        """Raises RefMeshError when the text is not a job."""
        try:
            values = json.loads(text)
            _check_types(values)
            lines = {name: tuple(values.get(name, ())) for name in ("warnings", "notes")}
            return cls(**{**values, **lines, "settings": Settings.from_flat(values.get("settings", {}))})
        except (ValueError, TypeError, AttributeError, RecursionError) as error:
            raise RefMeshError(f"the job file cannot be understood ({error}); start the job again") from error


def _check_types(values: dict) -> None:
    """Raises ValueError, naming the entry, for one of another type than a job has, or text that cannot be a path."""
    for name, kind in _TYPES.items():
        value = values.get(name, kind())
        texts = value if isinstance(value, list) else [value] if kind is str else []
        if not isinstance(value, kind) or not all(isinstance(text, str) and "\0" not in text for text in texts):
            raise ValueError(f"'{name}' is not what a job has there")
