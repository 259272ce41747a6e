"""The frames of a sequence, read once, checked, and kept as clean binary meshes in the cache."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import numpy as np

from ...core.capture.floaters import without_floaters
from ...core.capture.orientation import flipped_patches, inside_out_bodies, reoriented
from ...core.capture.seams import stitched
from ...core.errors import RefMeshError
from ...core.geometry.holes import capped
from ...core.geometry.mesh import merged
from ...core.types import TriangleMesh
from ...io.meshes import parse_mesh, read_bytes
from ...io.sequence import Sequence
from .cache import Cache, digest

FRAME_SCHEMA = 3
FRAMES_IN_MEMORY = 4  # enough for a frame, its neighbour and the anchor; a long take never fills the memory
LARGEST_SCALE_JUMP = 5.0  # between a frame's bounding-box diagonal and the median; bodies that come and go stay below


class Frames:
    """Meshes of a sequence by index, seams closed, oriented outward.

    mesh(index) : as captured.  surface(index) : the same without specks, what is followed and fitted.
    body(index) : the surface with its holes capped, so that it encloses a volume.
    keys : of each frame, made from the bytes of its file.  counts : of its triangles.  diagonals : (F,) of the bounding boxes, scene units.
    Raises RefMeshError, naming the file, for a frame that cannot be used.
    """

    def __init__(self, sequence: Sequence, cache: Cache, warn: Callable[[str], None], progress: Callable[[int, float], None]):
        self.sequence, self._cache = sequence, cache
        self.keys: list[str] = []
        self.counts: list[int] = []
        boxes = []
        for index, frame in enumerate(sequence.frames):
            progress(frame.number, index / len(sequence.frames))
            data = read_bytes(frame.path)
            self.keys.append(digest(FRAME_SCHEMA, data))
            arrays = cache.load_or_make(self._entry(index), self.keys[-1], lambda data=data, path=frame.path: _parsed(data, path))
            if arrays["inside_out"]:
                warn(f"{frame.path}: a body is inside out; its triangles are flipped")
            self.counts.append(len(arrays["triangles"]))
            boxes.append((arrays["vertices"].min(axis=0), arrays["vertices"].max(axis=0)))
        self.boxes = np.array(boxes)
        self.diagonals = np.linalg.norm(self.boxes[:, 1] - self.boxes[:, 0], axis=1)
        self._check_scales()
        self.mesh = lru_cache(maxsize=FRAMES_IN_MEMORY)(self._load)
        self.surface = lru_cache(maxsize=FRAMES_IN_MEMORY)(lambda index: without_floaters(self.mesh(index)))
        self.body = lru_cache(maxsize=FRAMES_IN_MEMORY)(lambda index: capped(self.surface(index)))

    def __len__(self) -> int:
        return len(self.keys)

    @property
    def diagonal(self) -> float:
        """Of the box around the whole sequence, scene units."""
        return float(np.linalg.norm(self.boxes[:, 1].max(axis=0) - self.boxes[:, 0].min(axis=0)))

    def path(self, index: int) -> Path:
        """The file of a frame."""
        return self.sequence.frames[index].path

    def _entry(self, index: int) -> str:
        return f"frames/frame_{self.sequence.frames[index].number:04d}"

    def _load(self, index: int) -> TriangleMesh:
        arrays = self._cache.load(self._entry(index), self.keys[index])
        if arrays is None:
            raise RefMeshError(f"{self.path(index)}: its cached copy disappeared during the run; start the run again")
        return TriangleMesh(arrays["vertices"], arrays["triangles"])

    def _check_scales(self) -> None:
        usual = float(np.median(self.diagonals))
        jump = np.maximum(self.diagonals / usual, usual / np.maximum(self.diagonals, np.finfo(float).tiny))
        worst = int(np.argmax(jump))
        if jump[worst] > LARGEST_SCALE_JUMP:
            raise RefMeshError(
                f"{self.path(worst)}: its bounding box is {self.diagonals[worst]:.4g} across where the others have about {usual:.4g}; "
                "export all frames in one unit, or leave it out with --frames"
            )


def _parsed(data: bytes, path: Path) -> dict[str, np.ndarray]:
    mesh = stitched(merged(parse_mesh(data, path))[0])
    mesh = reoriented(mesh, flipped_patches(mesh))
    inside_out = inside_out_bodies(mesh)
    return {"vertices": mesh.vertices, "triangles": reoriented(mesh, inside_out).triangles, "inside_out": inside_out.any()}
