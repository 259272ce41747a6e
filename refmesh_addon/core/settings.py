"""Every setting once: default, range, unit and help text. Panel, command line and pipeline are made from this.

No setting is a length, so that scaling the input scales the result and nothing else: radii are multiples of the mean edge length or of
the center spacing s = (enclosed volume / C)^(1/3), or shares of the bounding-box diagonal.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields

from .errors import RefMeshError
from .options import StageSettings, check_value, option

OVER_REFERENCE = -2  # value of `mesh_frame`: the mesh was made over the reference mesh
SIZES = ("512", "1024", "2048", "4096", "8192")  # of textures


@dataclass(frozen=True)
class TrackingSettings(StageSettings):
    """Volume tracking: centers that follow the inside of the body through the sequence."""

    surface: str = option(
        "auto",
        "What the capture is: bodies, or the surface that one camera, a phone or a partial scan sees, which has no inside of its own",
        choices={
            "auto": "Decided from the surface of all frames",
            "closed": "Bodies; holes are closed by a guess",
            "open": "Surfaces that end: the result ends where the capture does, and parts that a frame does not show can be hidden",
        },
    )
    bad_frames: str = option(
        "bridge",
        "What becomes of a few frames in which something is lost, doubled or leaps away, between frames that agree",
        choices={
            "bridge": "Their mesh moves on from the frame before to the one after",
            "cut": "The frame before is held, and another mesh begins after them",
            "fit": "They are followed and fitted as captured",
        },
    )
    centers: int = option(
        1000,
        "Points, called centers, that follow the volume; more of them reach thinner parts such as fingers and cost time",
        low=16, high=8000, label="Detail",
    )
    resolution: int = option(
        256, "Voxels along the longest side of a frame when the volume is filled", low=16, high=1024, label="Voxel Resolution"
    )
    tracking: str = option(
        "sequence",
        "How long centers are followed before tracking starts anew",
        choices={
            "sequence": "Through the whole sequence",
            "group": "Through the frames that share a reference mesh: errors do not accumulate, bodies that appear late get centers, "
            "and groups run in parallel; between groups centers step to new places",
        },
        label="Track Over",
    )
    affinity: str = option(
        "max",
        "How the affinity of two centers develops over time",
        choices={
            "max": "Largest separation and largest disagreement of motion so far",
            "iir": "Old disagreement of motion fades with time",
        },
        titles={"iir": "IIR"},
    )
    global_rounds: int = option(
        0,
        "Rounds that optimize all frames together after forward tracking: more uniform and stable, but slower; open captures have none",
        low=0,
        high=10,
    )


@dataclass(frozen=True)
class ReferenceSettings(StageSettings):
    """One reference mesh for each group of frames."""

    segments: str = option(
        "long",
        "How many frames have one mesh, and so one set of vertex numbers and UVs",
        choices={
            "long": "As long as one mesh serves them nearly as well as meshes of their groups",
            "groups": "Each group has a mesh of its own, as in the paper",
            "frames": "A given number of frames",
        },
        titles={"long": "As Long as It Fits", "groups": "Each Group", "frames": "N Frames"},
        label="One Mesh for",
    )
    segment_frames: int = option(60, "Frames that have one mesh when their number is given", low=1, high=100_000, label="Frames per Mesh")
    group_size: int = option(
        5,
        "Frames that share one reference mesh; 0 (auto) chooses groups by content: they end where bodies have deformed much or where "
        "something appears or leaves, and include frames that show touching bodies apart",
        low=0,
        high=1000,
        manual=5,
    )
    longest_group: int = option(10, "Maximum number of frames of a group when groups are chosen by content", low=1, high=1000)
    group_starts: str = option(
        "",
        "Frames, by the numbers of their files, that begin a group, such as 48,55; empty: by group size",
        label="Groups Begin at",
    )
    mesh: str = option(
        "",
        "Mesh file of your own, made over a frame or the reference mesh, which it replaces; its vertices keep their order",
        label="Own Mesh",
    )
    mesh_frame: int = option(
        -1,
        "Frame that the mesh of your own was made over, by the number of its file; -1 (first) is the first frame, -2 (reference) the "
        "reference positions, for a mesh made over the reference mesh of the whole take",
        low=OVER_REFERENCE,
        high=2**31 - 1,
    )
    apart: str = option(
        "",
        "Bodies that always touch but must be separate in the reference mesh, by points in a frame: '48: x y z, x y z | x y z' "
        "is frame 48, two points on one body, one point on another; the bodies are segmented from there",
        label="Bodies Apart",
    )
    stress: str = option(
        "plain",
        "How distances between centers are weighted when reference centers are placed",
        choices={
            "plain": "All equally, as in the paper",
            "near": "Short ones more: local shape counts more than distances across the body",
        },
    )
    mapping: str = option(
        "affinity",
        "How frames are carried to the reference positions",
        choices={
            "affinity": "Blend of the rigid motions of centers that move together; tears where bodies part",
            "rbf": "Thin-plate spline through all centers, as in the paper; smooth, so it cannot tear",
        },
        titles={"rbf": "RBF"},
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
    holes: str = option(
        "closed",
        "What becomes of the holes of bodies, such as soles that no camera saw",
        choices={
            "closed": "Each is closed by a smooth cap",
            "open": "The mesh stays open there, as open captures do everywhere that they end",
        },
        titles={"closed": "Close Smoothly", "open": "Leave Open"},
    )
    reconstruction: str = option(
        "builtin",
        "Which screened Poisson reconstruction makes the surface of the reference mesh",
        choices={
            "builtin": "RefMesh's own: keeps sharp edges, needs no other package",
            "pymeshlab": "The reference implementation, from PyMeshLab, which has to be installed",
        },
        titles={"builtin": "Built-in", "pymeshlab": "PyMeshLab"},
    )
    poisson_depth: int = option(
        0,
        "Screened Poisson reconstruction on 2^depth cells along the longest side; 0 (auto) takes it from the triangle budget",
        low=0,
        high=12,
        manual=8,
    )
    triangles: int = option(
        0,
        "Triangles of each reference mesh; 0 (auto) takes the median of the group's input frames, from 30,000 "
        "(60,000 for thin layers, fewer for bodies with flat faces) to 150,000",
        low=0, high=5_000_000, manual=30_000,
    )


@dataclass(frozen=True)
class DeformationSettings(StageSettings):
    """The reference mesh deformed to every frame of its group."""

    keypoint_search: str = option(
        "guided",
        "Where the match of a reference key point is searched",
        choices={
            "guided": "Near the place that the tracked centers carry it to",
            "unlimited": "Among all key points of the frame, as in the paper",
        },
        label="Key-Point Search",
    )
    keypoint_fit: str = option(
        "fixed",
        "How the patches around two key points are registered",
        choices={
            "fixed": "Rotated about the key point: distinguishes the palm from the back of the hand",
            "free": "Best rigid fit, as earlier methods do; for comparison",
        },
        label="Key-Point Fit",
    )
    arap_iterations: int = option(
        10,
        "Maximum number of local/global iterations of the deformation by key points; it ends sooner where it has converged",
        low=1, high=1000, label="ARAP Iterations",
    )
    smoothness: float = option(0.01, "Weight of the smooth-rotation term (alpha in the paper)", low=0.0, high=10.0)
    fit_rounds: int = option(
        6, "Rounds that pull the deformed surface onto the source; 0 stops after the key points, as in the paper", low=0, high=100
    )
    steady_frames: int = option(
        2,
        "Frames to either side over which the sliding of vertices along the surface is smoothed; 0 leaves each frame as it is",
        low=0,
        high=100,
    )


@dataclass(frozen=True)
class EvaluationSettings(StageSettings):
    """Two-sided distance between each source frame and its deformed reference."""

    samples: int = option(50_000, "Points sampled on each surface when distances are measured", low=100, high=5_000_000)


@dataclass(frozen=True)
class ColorSettings(StageSettings):
    """The colors of the capture on one layout per reference mesh."""

    texture: str = option(
        "auto",
        "Side of the textures in pixels; auto takes the size of the capture's own pictures",
        choices={"auto": "As large as the capture's pictures", "off": "No color", **{size: f"{size} x {size} pixels" for size in SIZES}},
    )
    exposure: str = option(
        "keep",
        "Whether changes of exposure over the take are evened out",
        choices={"keep": "As captured", "even": "One gain per frame and channel; the report lists them"},
    )
    color_drift: str = option(
        "off",
        "Whether vertices are moved along the surface to where the colors of the capture are those of the anchor frame",
        choices={
            "off": "Vertices stay where the shape alone puts them",
            "on": "Optical flow between textures moves vertices, which are then fitted again; takes a few seconds more per frame",
        },
        label="Drift by Color",
    )
    texture_format: str = option(
        "png",
        "Files of the texture sequence",
        choices={"png": "Lossless", "jpeg": "A fifth of the size, with slight artifacts"},
        titles={"png": "PNG", "jpeg": "JPEG"},
        label="Texture Files",
    )


@dataclass(frozen=True)
class Settings:
    """All settings, one frozen dataclass per stage."""

    tracking: TrackingSettings = TrackingSettings()
    reference: ReferenceSettings = ReferenceSettings()
    deformation: DeformationSettings = DeformationSettings()
    evaluation: EvaluationSettings = EvaluationSettings()
    color: ColorSettings = ColorSettings()

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
            check_value(known[name], value)
        stages = {}
        for stage in fields(cls):
            kind = type(getattr(cls, stage.name))
            names = {item.name for item in fields(kind)}
            stages[stage.name] = kind(**{name: value for name, value in values.items() if name in names})
        return cls(**stages)


STAGES = tuple(stage.name for stage in fields(Settings))  # in the order in which they run


def flat_fields() -> list:
    """The dataclass fields of all stages in order, as the panel and the command line show them."""
    return [item for stage in STAGES for item in fields(getattr(Settings, stage))]


def setting_names(stage: str) -> list[str]:
    """Names of the settings of one of STAGES, in order."""
    return [item.name for item in fields(getattr(Settings, stage))]


def choices_of(name: str) -> tuple[str, ...]:
    """The known values of a setting that chooses between named variants."""
    return next(tuple(item.metadata["choices"]) for item in flat_fields() if item.name == name)
