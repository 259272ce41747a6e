"""The encoder of a group: which nodes, which shape at rest, which steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .coder import Coder
from .connectivity import encoded_triangles
from .group import STEP, GridMesh, GroupShape, Source, coded_frames
from .node_fit import fitted_motion, reach_of, spread_nodes
from .node_motion import PARAMETER_BITS
from .rest_shape import coded_rest
from .skinning import ROTATION_BITS, at_rest, blended, edge_lengths, node_weights
from .topology import Topology

ROUNDS = 3  # in which the shape at rest and the motion from it are fitted to each other
MARGIN = 16 * STEP  # grid units around the frames, for a shape at rest that leaves their box a little


@dataclass(frozen=True)
class Balance:
    """How bits are shared out.

    nodes : control nodes.  rest : step of the shape at rest over that of one frame, times the square root of their number: what
    all frames share is coded once.  tangents : steps along tangents over those along normals.  shifts : step of the nodes' shifts and of
    what their rotations do at the distance of the next node, in steps of the motion.
    """

    nodes: int = 150
    rest: float = 1.4
    tangents: int = 5
    shifts: float = 1.0


def encoded_group(coder: Coder, frames: np.ndarray, triangles: np.ndarray, balance: Balance) -> tuple[GroupShape, GridMesh, np.ndarray]:
    """Codes a group; returns its shape, what a decoder will get, and the (V,) old number of each of its vertices.

    frames : (F, V, 3) float64, grid units, from MARGIN on.  triangles : (T, 3).
    """
    coded_triangles, order = encoded_triangles(coder, triangles, frames.shape[1])
    frames, topology = frames[:, order], Topology(coded_triangles, frames.shape[1])
    moving = len(frames) > 1 and bool(np.abs(frames - frames[:1]).max(initial=0.0) > 0.5)
    rest_step = max(1, round(balance.rest * STEP / len(frames) ** 0.5)) if moving else STEP
    target = _mean_at_rest(topology, frames, balance.nodes) if moving else frames.mean(axis=0)
    rest = coded_rest(coder, topology, rest_step, target)
    counts = len(rest), len(coded_triangles), len(frames)
    if not moving:
        still = GroupShape(*counts, rest_step, STEP, balance.tangents, 0, 0, 1, 1)
        return still, GridMesh(np.repeat(rest[None], len(frames), axis=0), coded_triangles), order
    lengths = edge_lengths(topology.adjacency, rest)
    nodes = spread_nodes(lengths, balance.nodes)
    reach = int(reach_of(lengths, nodes))
    shift = max(1, round(balance.shifts * STEP))
    turn = max(1, round((1 << PARAMETER_BITS) * shift / (4 * reach / 3)))  # an angle is four times its parameter
    shape = GroupShape(*counts, rest_step, STEP, balance.tangents, len(nodes), reach, turn, shift)
    points = coded_frames(coder, topology, shape, rest, Source(frames, nodes))
    return shape, GridMesh(points, coded_triangles), order


def _mean_at_rest(topology: Topology, frames: np.ndarray, nodes: int) -> np.ndarray:
    """(V, 3) the mean of all frames, each carried back by the motion of control nodes; first near the middle frame, then near the mean."""
    rest = frames[len(frames) // 2]
    for _ in range(ROUNDS):
        lengths = edge_lengths(topology.adjacency, np.rint(rest))
        chosen = spread_nodes(lengths, nodes)
        weights = node_weights(lengths, chosen, reach_of(lengths, chosen))
        rotations, shifts = fitted_motion(weights, rest, frames, chosen)
        total = np.zeros(rest.shape)
        for frame, rotation, shift in zip(frames, rotations, shifts):
            total += at_rest(blended(weights, rest[chosen], (rotation * (1 << ROTATION_BITS), shift)), frame)
        rest = total / len(frames)
    return rest
