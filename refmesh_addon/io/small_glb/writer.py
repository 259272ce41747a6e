"""Writes a sequence as a small GLB: groups of one mesh and a few morph targets, which take turns without a gap.

Every group is a node that an animation shows and hides by its scale, 1 or 0, and below it a node that turns whole numbers into scene
units. Weights are keyed on every frame at its exact time; the scale of both groups changes at once, a small part of a frame before the
first frame of the next, so that no rounding of times in a player can show the wrong group on it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ...core.compression.morph_targets import MorphTargets, fitted_morph_targets, mean_normals, packed_bits
from ...core.compression.reduction import reduced
from ...core.errors import RefMeshError
from ...core.geometry.mesh import normalized
from ..files import atomic_file
from ..refmesh_stream.writer import FrameGroup
from .container import Container
from .triangle_order import packing_order

EVERY = 1 << 30  # triangles: none is left out
ERRORS = tuple(2e-4 * 2 ** (step / 2) for step in range(11))  # that are tried for a rate
EARLY = 1 / 64  # of a frame, that groups take turns before the first frame of the next
ENOUGH = 0.5  # of the error: where fewer triangles use up less, more of them save nothing
LEAST_LEFT = 0.3  # of the error is for morph targets, whatever reducing triangles uses up
TRIANGLE_BITS = 9  # that a triangle takes about
GREATEST = (1 << 16) - 1  # whole number of a position
SLACK = 1e-6  # of the error, for rounding
NORMAL_SCALE = 127  # whole number of a unit normal
NORMAL_STEPS = 12  # from 0 to 1 along each axis, to which normals are rounded before they get their length back


@dataclass(frozen=True)
class SmallGlb:
    """How good and how large.

    error : RMS distance from the frames along normals, share of the bounding-box diagonal.  triangles : numbers that are tried in turn
    as long as they help; the last is taken where none is close enough.  targets : fewest and most morph targets of a group.
    packed : by EXT_meshopt_compression, which Blender reads from 5.2 on.  normals : with the mean normals of each group, so that it
    looks smooth; without them a viewer shades triangles flat.  placement : (4, 4) from scene units to those of the file, which has y up.
    """

    error: float = 5e-4
    triangles: tuple[int, ...] = (8000, 11000, 15000, 20000, EVERY)
    targets: tuple[int, int] = (3, 8)
    packed: bool = False
    normals: bool = True
    placement: np.ndarray = field(default_factory=lambda: np.eye(4))


@dataclass(frozen=True)
class WrittenGroup:
    """What a group became.  error : RMS, share of the diagonal.  triangles, targets : counts."""

    numbers: tuple[int, ...]
    error: float
    triangles: int
    targets: int


def write_small_glb(
    path: str | Path, groups: Iterable[FrameGroup], diagonal: float, frame_rate: float, choice: SmallGlb
) -> list[WrittenGroup]:
    """Writes the groups, in their order; returns what each became.

    diagonal : of the bounding box of the whole sequence, scene units.  frame_rate : frames per second; frame n is shown at
    (n - first) / frame_rate seconds. A group that needs more morph targets is written in several runs of frames. Raises RefMeshError when
    the file cannot be written, or the error cannot be reached: it says which can.
    """
    data, written = encoded(groups, diagonal, frame_rate, choice)
    with atomic_file(path) as file:
        file.write(data)
    return written


def encoded(groups: Iterable[FrameGroup], diagonal: float, frame_rate: float, choice: SmallGlb) -> tuple[bytes, list[WrittenGroup]]:
    """What `write_small_glb` writes, and what each group became."""
    container, models, written = Container(choice.packed), [], []
    for group in groups:
        for numbers, best in _runs(group, choice, diagonal):
            written.append(WrittenGroup(numbers, best.error / diagonal, len(best.triangles), len(best.model.targets)))
            models.append((numbers, best.model, _mesh(container, best, choice.normals)))
    _check_error(written, choice)
    _add_scene(container, models, frame_rate, choice.placement)
    return container.finished(), written


def within_rate(group: FrameGroup, diagonal: float, frame_rate: float, choice: SmallGlb, mbps: float) -> SmallGlb:
    """The choice with the smallest error, of some in equal ratios, whose file of this one group stays within a rate.

    mbps : 10^6 bits per second. Raises RefMeshError where the largest error tried does not: it says what rate does.
    """
    for error in ERRORS:
        tried = replace(choice, error=error)
        rate = 8e-6 * len(encoded([group], diagonal, frame_rate, tried)[0]) * frame_rate / len(group.numbers)
        if rate <= mbps:
            return tried
    raise RefMeshError(f"{mbps:g} Mbit/s cannot be reached, {rate:.2g} can, with an error of {100 * ERRORS[-1]:.2g} %; make larger groups")


@dataclass(frozen=True)
class _Candidate:
    """A group as it could be written.  triangles : (T, 3).  frames : (F, V, 3) that the model stands for.  error : RMS, scene units."""

    model: MorphTargets
    triangles: np.ndarray
    frames: np.ndarray
    error: float

    def rank(self, error: float) -> tuple[float, float]:
        """Low is better: first to be close enough, then to be small."""
        return max(self.error, error), packed_bits(self.model) + TRIANGLE_BITS * len(self.triangles)


def _runs(group: FrameGroup, choice: SmallGlb, diagonal: float) -> Iterator[tuple[tuple[int, ...], _Candidate]]:
    """The group as a whole where that is close enough, else in halves; with the numbers of the frames."""
    error, count = choice.error * diagonal, len(group.numbers)
    best = min(_candidates(group, choice, diagonal), key=lambda candidate: candidate.rank(error))
    if best.error <= (1 + SLACK) * error or count <= choice.targets[1]:
        yield group.numbers, best
        return
    for part in (slice(0, count // 2), slice(count // 2, count)):
        yield from _runs(FrameGroup(group.numbers[part], group.positions[part], group.triangles), choice, diagonal)


def _candidates(group: FrameGroup, choice: SmallGlb, diagonal: float) -> Iterator[_Candidate]:
    """One for each number of triangles, up to the first that leaves most of the error to morph targets."""
    error, (fewest, most) = choice.error * diagonal, choice.targets
    for count in choice.triangles:
        reduction = reduced(group.positions, group.triangles, count)
        triangles, order = packing_order(reduction.triangles, reduction.frames.shape[1])
        left = np.sqrt(max(error**2 - reduction.error**2, (LEAST_LEFT * error) ** 2))
        model = fitted_morph_targets(reduction.frames[:, order], triangles, float(left), range(fewest, most + 1))
        _check(group, model)
        yield _Candidate(model, triangles, reduction.frames[:, order], float(np.hypot(reduction.error, model.error)))
        if reduction.error < ENOUGH * error:
            break


def _check(group: FrameGroup, model: MorphTargets) -> None:
    if model.base.max(initial=0) > GREATEST or np.abs(model.targets).max(initial=0) > GREATEST // 2:
        frames = f"frames {group.numbers[0]} to {group.numbers[-1]}"
        raise RefMeshError(f"{frames}: an error that small needs more than 16 bits; allow a larger one")


def _check_error(written: list[WrittenGroup], choice: SmallGlb) -> None:
    worst = max(written, key=lambda group: group.error)
    if worst.error > choice.error * (1 + SLACK):
        most = f"{choice.targets[1]} morph targets and {worst.triangles} triangles"
        where = f"frames {worst.numbers[0]} to {worst.numbers[-1]}"
        reached = f"{100 * worst.error:.2g}"
        raise RefMeshError(f"{where}: an error of {100 * choice.error:.3g} % cannot be reached with {most}: allow {reached} %")


def _mesh(container: Container, group: _Candidate, normals: bool) -> dict:
    """A glTF mesh; its weights are those of the first frame."""
    model, triangles = group.model, group.triangles
    attributes = {"POSITION": container.vertices([model.base.astype(np.uint16)])[0]}
    if normals:
        directions = normalized(np.rint(NORMAL_STEPS * mean_normals(group.frames, triangles)))
        attributes["NORMAL"] = container.vertices([np.rint(NORMAL_SCALE * directions).astype(np.int8)], normalized=True)[0]
    primitive: dict = {"attributes": attributes, "indices": container.triangles(triangles)}
    if not len(model.targets):
        return {"primitives": [primitive]}
    kind = np.int8 if np.abs(model.targets).max() <= 127 else np.int16
    primitive["targets"] = [{"POSITION": accessor} for accessor in container.vertices(list(model.targets.astype(kind)))]
    return {"primitives": [primitive], "weights": model.weights[0].tolist()}


def _add_scene(
    container: Container, models: list[tuple[tuple[int, ...], MorphTargets, dict]], frame_rate: float, placement: np.ndarray
) -> None:
    """Nodes of all groups, below one that places them about the first, and the animation that plays them."""
    center = models[0][1].origin  # far from the origin, single precision would be too coarse for every group by itself
    place = placement.copy()
    place[:3, 3] += place[:3, :3] @ center
    nodes, animation = [_root(models[0][1].origin, placement)], _Animation(container)
    first = models[0][0][0]
    switches = [(numbers[0] - first - EARLY) / frame_rate for numbers, _, _ in models]
    for index, (numbers, model, _) in enumerate(models):
        switch, body = len(nodes), len(nodes) + 1
        nodes[0]["children"].append(switch)
        nodes.append({"name": f"frames {numbers[0]} to {numbers[-1]}", "children": [body]} | ({"scale": [0, 0, 0]} if index else {}))
        nodes.append({"mesh": index, "translation": (model.origin - models[0][1].origin).tolist(), "scale": [model.unit] * 3})
        if len(models) > 1:
            times, shown = _switched(switches, index)
            animation.add((switch, "scale"), times, np.repeat(shown[:, None], 3, axis=1), "STEP")
        if len(model.targets) and len(numbers) > 1:
            animation.add((body, "weights"), (np.array(numbers) - first) / frame_rate, model.weights.ravel(), "LINEAR")
    meshes = [mesh for _, _, mesh in models]
    container.content = {"scene": 0, "scenes": [{"nodes": [0]}], "nodes": nodes, "meshes": meshes, **animation.content()}


def _root(center: np.ndarray, placement: np.ndarray) -> dict:
    """The node of everything, about the first group: far from the origin, single precision would be too coarse for each by itself."""
    place = placement.copy()
    place[:3, 3] += place[:3, :3] @ center
    return {"name": "RefMesh", "children": [], "matrix": place.T.ravel().tolist()}


def _switched(switches: list[float], index: int) -> tuple[np.ndarray, np.ndarray]:
    """Times at which group `index` is shown (1) or hidden (0), from 0 on."""
    times, shown = [0.0], [float(index == 0)]
    if index:
        times.append(switches[index])
        shown.append(1.0)
    if index + 1 < len(switches):
        times.append(switches[index + 1])
        shown.append(0.0)
    return np.array(times), np.array(shown)


class _Animation:
    """Channels and samplers of one animation."""

    def __init__(self, container: Container):
        self._container = container
        self._channels: list[dict] = []
        self._samplers: list[dict] = []

    def add(self, target: tuple[int, str], times: np.ndarray, values: np.ndarray, interpolation: str) -> None:
        """A channel.  target : number of a node, and what of it changes.  times : (N,) seconds.  values : at these times."""
        node, path = target
        sampler = {"input": self._container.values(times), "output": self._container.values(values), "interpolation": interpolation}
        self._samplers.append(sampler)
        self._channels.append({"sampler": len(self._samplers) - 1, "target": {"node": node, "path": path}})

    def content(self) -> dict:
        """The animation as the document holds it; nothing where nothing changes."""
        if not self._channels:
            return {}
        return {"animations": [{"name": "RefMesh", "samplers": self._samplers, "channels": self._channels}]}
