"""Every setting once: default, range, unit and help text. Panel, command line and pipeline are made from this.

No setting is a length: radii are multiples of the center spacing s = (enclosed volume / C)^(1/3), of the mean edge
length, or shares of the bounding-box diagonal, so that scaling the input scales the result and nothing else.
"""

from __future__ import annotations

from dataclasses import Field, asdict, dataclass, field, fields
from typing import Any

from .errors import RefMeshError


def option(default, help: str, *, low=None, high=None, choices: dict[str, str] | None = None, label: str | None = None):
    """A dataclass field that carries what a panel or a command line needs to show it.

    low, high : inclusive bounds of a number.  choices : name -> one-line explanation.  label : words for the panel.
    """
    return field(default=default, metadata={"help": help, "low": low, "high": high, "choices": choices, "label": label})


def setting_names(stage: str) -> list[str]:
    """Names of the settings of one of STAGES, in order."""
    return [item.name for item in fields(getattr(Settings, stage))]


def _check_value(item: Field, value: object) -> None:
    """Raises RefMeshError, naming the option, for a value that the setting does not take."""
    choices, low, high = item.metadata["choices"], item.metadata["low"], item.metadata["high"]
    flag = "--" + item.name.replace("_", "-")
    if choices is not None:
        if value not in choices:
            raise RefMeshError(f"{flag} is '{value}': choose one of {', '.join(choices)}")
    elif isinstance(item.default, str):
        if not isinstance(value, str):
            raise RefMeshError(f"{flag} is {value}: give a text")
    else:
        integer = isinstance(item.default, int)
        number = isinstance(value, int if integer else (int, float)) and not isinstance(value, bool)
        if not number or not low <= value <= high:
            raise RefMeshError(f"{flag} is {value}: give a {'whole number' if integer else 'number'} from {low} to {high}")


class _KnownChoices:
    """Refuses unknown choices as soon as the settings of a stage are built, not only in `Settings.from_flat`."""

    def __post_init__(self):
        for item in fields(self):  # type: ignore[arg-type]  # only dataclasses derive from this
            if item.metadata["choices"] is not None:
                _check_value(item, getattr(self, item.name))


@dataclass(frozen=True)
class TrackingSettings(_KnownChoices):
    """Volume tracking: centers that follow the inside of the body through the sequence."""

    centers: int = option(
        1000, "Points that follow the volume; more of them reach thinner parts such as fingers and cost time", low=16, high=8000
    )
    resolution: int = option(
        256, "Voxels along the longest side of a frame when the volume is filled", low=16, high=1024, label="Voxel Resolution"
    )
    tracking: str = option(
        "sequence",
        "How far a center is followed before tracking starts anew",
        choices={
            "sequence": "Through the whole sequence",
            "group": "Through the frames that share a reference mesh: nothing piles up, bodies that come late get their centers, "
            "and groups share the cores; at each group centers step to new places",
        },
        label="Track Over",
    )
    affinity: str = option(
        "max",
        "How strongly two centers are taken to belong together over time",
        choices={
            "max": "The largest separation and the largest disagreement of motion ever seen decide",
            "iir": "Old disagreement fades with time",
        },
    )
    global_rounds: int = option(
        0,
        "Rounds that optimise all frames together after forward tracking: more even, steadier, and slower",
        low=0,
        high=10,
    )


@dataclass(frozen=True)
class ReferenceSettings(_KnownChoices):
    """One reference mesh for each group of frames."""

    group_size: int = option(
        5,
        "Frames that share one reference mesh; 0 (auto) chooses groups by content: they end where bodies have deformed much, or where "
        "something appears or leaves, and see apart what touches",
        low=0,
        high=1000,
    )
    longest_group: int = option(10, "Most frames of a group when groups are chosen by content", low=1, high=1000)
    group_starts: str = option(
        "",
        "Frames, by the numbers of their files, that begin a group, such as 48,55; empty leaves it to the group size",
        label="Groups Begin at",
    )
    apart: str = option(
        "",
        "Bodies that touch all the time and are to be apart in the reference mesh, by points in a frame: '48: x y z, x y z | x y z' "
        "is frame 48, two points of one body, one point of another; what belongs to each is found from there",
        label="Bodies Apart",
    )
    stress: str = option(
        "plain",
        "Which distances between centers the reference centers keep first",
        choices={
            "plain": "All alike, as in the paper",
            "near": "Those between near centers: local shape counts more than distances across the body",
        },
    )
    mapping: str = option(
        "affinity",
        "How frames are carried to the reference positions",
        choices={
            "affinity": "Blend the rigid motions of centers that move together; tears where bodies part",
            "rbf": "Thin-plate spline through all centers, as in the paper; smooth, so it cannot tear",
        },
    )
    alignment_steps: int = option(
        8, "Steps, from stiff to soft, that align each frame with the anchor frame; 0 leaves frames as they are mapped", low=0, high=50
    )
    least_overlap: float = option(
        0.85,
        "Overlap (IoU) with the anchor frame that a frame must reach to count for the surface of the reference mesh; 0 lets all count",
        low=0.0,
        high=1.0,
    )
    poisson_depth: int = option(
        0,
        "Screened Poisson reconstruction on 2^depth cells along the longest side; 0 (auto) takes it from the triangle budget",
        low=0,
        high=12,
    )
    triangles: int = option(
        0,
        "Triangles of each reference mesh; 0 (auto) takes the median of the group's input frames, and at least 30,000",
        low=0,
        high=5_000_000,
    )


@dataclass(frozen=True)
class DeformationSettings(_KnownChoices):
    """The reference mesh deformed to every frame of its group."""

    keypoint_search: str = option(
        "guided",
        "Where partners of a reference key point are looked for",
        choices={
            "guided": "Near the place where the tracked centers carry it",
            "unlimited": "Among all key points of the frame, as in the paper",
        },
        label="Key-Point Search",
    )
    keypoint_fit: str = option(
        "fixed",
        "How the surroundings of two key points are laid on each other",
        choices={
            "fixed": "Turned about the key point, which stays: tells the palm from the back of the hand",
            "free": "Best rigid fit, as earlier methods do; for comparison",
        },
        label="Key-Point Fit",
    )
    arap_iterations: int = option(
        10,
        "Most rounds of the deformation by key points, each local and global; it ends sooner where nothing moves",
        low=1,
        high=1000,
        label="ARAP Iterations",
    )
    smoothness: float = option(0.01, "Weight of the smooth-rotation term (alpha in the paper)", low=0.0, high=10.0)
    fit_rounds: int = option(
        6, "Rounds that pull the deformed surface onto the source; 0 stops after the key points, as in the paper", low=0, high=100
    )
    steady_frames: int = option(
        2,
        "Frames to either side that help to bring vertices to rest which tremble along the surface; 0 leaves each frame by itself",
        low=0,
        high=100,
    )


@dataclass(frozen=True)
class EvaluationSettings(_KnownChoices):
    """Two-sided distance between each source frame and its deformed reference."""

    samples: int = option(50_000, "Points sampled on each surface when distances are measured", low=100, high=5_000_000)


@dataclass(frozen=True)
class Settings:
    """All settings, one frozen dataclass per stage."""

    tracking: TrackingSettings = TrackingSettings()
    reference: ReferenceSettings = ReferenceSettings()
    deformation: DeformationSettings = DeformationSettings()
    evaluation: EvaluationSettings = EvaluationSettings()

    def to_flat(self) -> dict[str, object]:
        """name -> value over all stages; names are unique."""
        return {name: value for stage in asdict(self).values() for name, value in stage.items()}

    @classmethod
    def from_flat(cls, values: dict[str, object]) -> Settings:
        """Settings from a flat name -> value table; what is missing keeps its default.

        Raises RefMeshError for an unknown name or a value out of range, naming it.
        """
        known = {item.name: item for item in flat_fields()}
        for name, value in values.items():
            if name not in known:
                raise RefMeshError(f"unknown setting '{name}': the settings are {', '.join(sorted(known))}")
            _check_value(known[name], value)
        stages = {}
        for stage in fields(cls):
            names = {item.name for item in fields(_stage_type(stage))}
            stages[stage.name] = _stage_type(stage)(**{name: value for name, value in values.items() if name in names})
        return cls(**stages)


STAGES = tuple(stage.name for stage in fields(Settings))  # in the order in which they run


def flat_fields() -> list:
    """The dataclass fields of all stages in order, as the panel and the command line show them."""
    return [item for stage in fields(Settings) for item in fields(_stage_type(stage))]


def choices_of(name: str) -> tuple[str, ...]:
    """The known values of a setting that chooses between named variants."""
    return next(tuple(item.metadata["choices"]) for item in flat_fields() if item.name == name)


def _stage_type(stage: Field) -> Any:
    """The dataclass of one stage."""
    return type(stage.default)


EDITS = ("group_starts", "apart")  # what a person noted about one sequence: no preset knows it, so none changes it
# What each preset changes; everything else keeps its default.
PRESETS: dict[str, dict[str, object]] = {
    "draft": {"centers": 400, "resolution": 128, "alignment_steps": 3, "fit_rounds": 4, "samples": 10_000},
    "standard": {},
    "paper": {"resolution": 512, "mapping": "rbf", "keypoint_search": "unlimited", "fit_rounds": 0, "steady_frames": 0},
}
