"""A group of frames with one topology: its triangles, its shape at rest, the motion of control nodes, and what they leave."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..types import FrozenArrays
from .coder import Coder
from .connectivity import decoded_triangles
from .displacements import coded_fields
from .node_fit import fitted_motion
from .node_motion import coded_motion
from .rest_shape import coded_rest
from .skinning import NodeMotion, at_rest, blended, edge_lengths, moved, node_weights
from .surface_frames import along_frames, from_frames, surface_frames
from .temporal_basis import coded_basis, coefficients, courses_above, fitted_basis, over_frames
from .topology import Topology

GREATEST_EXTENT = 1 << 22  # grid units along an axis; products of three integers then stay exact
STEP = 64  # grid units of a step of the motion along normals


@dataclass(frozen=True)
class GroupShape:
    """What a decoder must know before anything else.

    vertices, triangles, frames : counts.  rest_step, motion_step, tangent_ratio : quantization, grid units.
    nodes : control nodes, 0 in a group that stands still.  reach : grid units along edges from a vertex to the nodes that move it.
    rotation_step, shift_step : quantization of the nodes' motion.
    """

    vertices: int
    triangles: int
    frames: int
    rest_step: int
    motion_step: int
    tangent_ratio: int
    nodes: int
    reach: int
    rotation_step: int
    shift_step: int


@dataclass(frozen=True)
class GridMesh(FrozenArrays):
    """points : (F, V, 3) whole positions in float64, grid units.  triangles : (T, 3) int64."""

    points: np.ndarray
    triangles: np.ndarray


@dataclass(frozen=True)
class Source(FrozenArrays):
    """What an encoder knows.  frames : (F, V, 3), grid units, in the order of decoded vertices.  nodes : (J,)."""

    frames: np.ndarray
    nodes: np.ndarray


def decoded_group(coder: Coder, shape: GroupShape) -> GridMesh:
    """The frames of a group. Raises ValueError where its stream cannot be right."""
    triangles = decoded_triangles(coder, shape.triangles, shape.vertices)
    topology = Topology(triangles, shape.vertices)
    rest = coded_rest(coder, topology, shape.rest_step, None)
    if not (np.abs(rest) <= GREATEST_EXTENT).all():
        raise ValueError("positions lie outside of the grid")
    if not shape.nodes:
        return GridMesh(np.repeat(rest[None], shape.frames, axis=0), triangles)
    return GridMesh(coded_frames(coder, topology, shape, rest, None), triangles)


def coded_frames(coder: Coder, topology: Topology, shape: GroupShape, rest: np.ndarray, source: Source | None) -> np.ndarray:
    """(F, V, 3) as a decoder sees them."""
    given = None if source is None else source.nodes
    chosen = [coder.number(None if given is None else int(given[index]), topology.count) for index in range(shape.nodes)]
    nodes = np.array(chosen, dtype=np.int64)
    weights = node_weights(edge_lengths(topology.adjacency, rest), nodes, float(shape.reach))
    target = None if source is None else NodeMotion(*fitted_motion(weights, rest, source.frames, nodes))
    motion = coded_motion(coder, rest[nodes], shape.frames, (shape.rotation_step, shape.shift_step), target)
    move = [blended(weights, rest[nodes], motion.of(frame)) for frame in range(shape.frames)]
    axes = surface_frames(topology.triangles, rest, np.arange(topology.count))
    local = None
    if source is not None:
        local = np.stack([along_frames(axes, at_rest(maps, frame) - rest) for maps, frame in zip(move, source.frames)])
    along = _coded_local(coder, topology, shape, local)
    return np.stack([moved(maps, rest + from_frames(axes, components)) for maps, components in zip(move, along)])


def _coded_local(coder: Coder, topology: Topology, shape: GroupShape, local: np.ndarray | None) -> np.ndarray:
    """(F, V, 3) whole displacements along normal and tangents.  local : what they should be, None when decoding."""
    steps = shape.motion_step * np.array([1.0, shape.tangent_ratio, shape.tangent_ratio])
    fields = None if local is None else (local[..., 0], np.hstack([local[..., 1], local[..., 2]]))
    exact = None if fields is None else _kept_courses(fields, steps)
    bases = [coded_basis(coder, None if exact is None else exact[index], shape.frames) for index in range(2)]
    if bases[0].shape != bases[1].shape:
        raise ValueError("normals and tangents have different numbers of courses")
    goal = None
    if fields is not None:
        along, across = (coefficients(basis, field) for basis, field in zip(bases, fields))
        goal = np.stack([along, *np.split(across, 2, axis=1)], axis=-1).transpose(1, 0, 2)
    values = coded_fields(coder, topology, steps, bases[0].shape[1], goal)
    return np.stack([over_frames(bases[min(axis, 1)], values[..., axis].T) for axis in range(3)], axis=-1)


def _kept_courses(fields: tuple[np.ndarray, np.ndarray], steps: np.ndarray) -> list[np.ndarray]:
    """(F, K) basis of the displacements along normals, and of those along tangents; a course too weak for any step is left out."""
    bases = [fitted_basis(field) for field in fields]
    kept = max(courses_above(coefficients(basis, field), step / 2) for basis, field, step in zip(bases, fields, steps))
    return [basis[:, :kept] for basis in bases]
