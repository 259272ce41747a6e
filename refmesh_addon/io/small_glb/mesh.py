"""The glTF mesh of a run of frames: its base, its morph targets, and what it shares with the other runs of its segment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.compression.morph_targets import mean_normals
from ...core.geometry.mesh import normalized
from .container import Container
from .segment import Run, Segment
from .surface import Surface, material, surface_attributes

NORMAL_SCALE = 127  # whole number of a unit normal
NORMAL_STEPS = 12  # from 0 to 1 along each axis, to which normals are rounded before they get their length back


@dataclass(frozen=True)
class SharedParts:
    """Numbers of what all runs of a segment share.  attributes : name -> accessor.  indices : accessor.  material : of the document."""

    attributes: dict[str, int]
    indices: int
    material: int

    @classmethod
    def of(cls, container: Container, segment: Segment, surface: Surface) -> SharedParts:
        """Adds them to the file."""
        attributes, indices = surface_attributes(container, surface), container.triangles(surface.triangles)
        return cls(attributes, indices, material(container, segment, surface))


def run_mesh(container: Container, segment: Segment, surface: Surface, shared: SharedParts, run: Run, normals: bool) -> dict:
    """The mesh; its weights are those of the first frame."""
    model, owners = run.model, surface.owners
    attributes = {"POSITION": container.vertices([model.base[owners].astype(np.uint16)])[0], **shared.attributes}
    if normals:
        directions = normalized(np.rint(NORMAL_STEPS * mean_normals(segment.frames[run.rows], segment.triangles)[owners]))
        attributes["NORMAL"] = container.vertices([np.rint(NORMAL_SCALE * directions).astype(np.int8)], normalized=True)[0]
    primitive: dict = {"attributes": attributes, "indices": shared.indices, "material": shared.material}
    if not len(model.targets):
        return {"primitives": [primitive]}
    kind = np.int8 if np.abs(model.targets).max() <= 127 else np.int16
    primitive["targets"] = [{"POSITION": accessor} for accessor in container.vertices(list(model.targets[:, owners].astype(kind)))]
    return {"primitives": [primitive], "weights": model.weights[0].tolist()}
