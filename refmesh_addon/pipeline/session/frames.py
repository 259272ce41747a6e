"""The frames of a sequence as the stages ask for them: by index, few in memory at a time."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import numpy as np

from ...core.capture.floaters import without_floaters
from ...core.capture.openness import openness
from ...core.errors import RefMeshError
from ...core.geometry.storage_offset import storage_offset
from ...core.surfacing.hole_caps import smoothly_capped
from ...core.types import TriangleMesh
from ...io.frame_range import format_ranges
from ...io.sequence import Sequence
from .capture import CapturedSequence, capture_sequence
from .session import Session
from .stage_share import StageShare

FRAMES_IN_MEMORY = 4  # enough for a frame, its neighbor and the anchor; a long take never fills the memory
LARGEST_SCALE_JUMP = 5.0  # between a frame's bounding-box diagonal and the median; bodies that come and go stay below


class Frames:
    """Meshes of a sequence by index, seams closed, oriented outward.

    mesh(index) : as captured.  surface(index) : the same without floaters, what is followed and fitted.
    capped(index) : the surface with its holes capped, and which triangles cap them.  body(index) : the mesh of it, which encloses a volume.
    keys : of each frame, from the bytes of its file.  counts : of its triangles.  boxes : (F, 2, 3) their lowest and highest
    corners.  diagonals : (F,) of the boxes, scene units.  statistics : of each frame as it came.
    Raises RefMeshError, naming the file, for a frame that is not of the size of the others.
    """

    def __init__(self, sequence: Sequence, captured: CapturedSequence):
        self.sequence, self._files = sequence, captured.files
        self.keys = [captured.keys[index] for index in range(len(sequence.frames))]
        self.counts, self.inside_out, self.statistics, boxes = [], [], [], []
        for file in captured.files.values():
            frame = file.captured
            self.counts.append(len(frame.mesh.triangles))
            self.inside_out.append(frame.inside_out)
            self.statistics.append(frame.statistics)
            boxes.append((frame.mesh.vertices.min(axis=0), frame.mesh.vertices.max(axis=0)))
        self.boxes = np.array(boxes)
        self.diagonals = np.linalg.norm(self.boxes[:, 1] - self.boxes[:, 0], axis=1)
        self._check_scales()
        self.mesh = lru_cache(maxsize=FRAMES_IN_MEMORY)(self._load)
        self.surface = lru_cache(maxsize=FRAMES_IN_MEMORY)(lambda index: without_floaters(self.mesh(index)))
        self.capped = lru_cache(maxsize=FRAMES_IN_MEMORY)(lambda index: smoothly_capped(self.surface(index)))

    def __len__(self) -> int:
        return len(self.keys)

    @property
    def diagonal(self) -> float:
        """Of the box around the whole sequence, scene units."""
        return float(np.linalg.norm(self.boxes[:, 1].max(axis=0) - self.boxes[:, 0].min(axis=0)))

    @property
    def offset(self) -> np.ndarray:
        """(3,) about which positions are stored in single precision, by the first frame; zeros near the origin."""
        return storage_offset(*self.boxes[0])

    def body(self, index: int) -> TriangleMesh:
        """The surface with its holes capped."""
        return self.capped(index).mesh

    def path(self, index: int) -> Path:
        """The file of a frame."""
        return self.sequence.frames[index].path

    def _load(self, index: int) -> TriangleMesh:
        try:
            return self._files[index].captured.mesh
        except RefMeshError as error:
            raise RefMeshError(f"{self.path(index)}: its cached copy disappeared during the run; start the run again") from error

    def _check_scales(self) -> None:
        usual = float(np.median(self.diagonals))
        jump = np.maximum(self.diagonals / usual, usual / np.maximum(self.diagonals, np.finfo(float).tiny))
        worst = int(np.argmax(jump))
        if jump[worst] > LARGEST_SCALE_JUMP:
            raise RefMeshError(
                f"{self.path(worst)}: its bounding box is {self.diagonals[worst]:.4g} across where the others have about {usual:.4g}; "
                "export all frames in one unit, or leave it out with --frames"
            )


def _warn_of_open_frames(frames: Frames, warn: Callable[[str], None]) -> None:
    """One warning for all frames without volume, at the worst."""
    numbers = frames.sequence.numbers
    open_frames = [index for index, one in enumerate(frames.statistics) if openness(one.capped, one.compactness)]
    if open_frames:
        worst = max(open_frames, key=lambda index: (frames.statistics[index].capped, -frames.statistics[index].compactness))
        reason = openness(frames.statistics[worst].capped, frames.statistics[worst].compactness)
        ranges = format_ranges(numbers[index] for index in open_frames)
        warn(f"frame {numbers[worst]}: {reason} (of {len(numbers)} frames this holds for {len(open_frames)}: {ranges})")


def read_frames(session: Session, sequence: Sequence, share: StageShare, warn: Callable[[str], None]) -> Frames:
    """The frames of a sequence; warns of those that were inside out. Raises RefMeshError for a frame that cannot be used."""
    frames = Frames(sequence, capture_sequence(session, sequence, share))
    for frame, inside_out in zip(sequence.frames, frames.inside_out, strict=True):
        if inside_out:
            warn(f"{frame.path}: a body is inside out; its triangles are flipped")
    _warn_of_open_frames(frames, warn)
    return frames
