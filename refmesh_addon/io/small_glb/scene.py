"""The nodes of a small GLB and the animation that plays them.

Every run is a node that the animation shows and hides by its scale, 1 or 0, and below it a node that turns whole numbers into scene
units. Weights are keyed on every frame at its exact time; the scale of both runs changes at once, a small part of a frame before the
first frame of the next, so that no rounding of times in a player can show the wrong run on it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.compression.morph_targets import MorphTargets
from .container import Container

EARLY = 1 / 64  # of a frame, that runs take turns before the first frame of the next


@dataclass(frozen=True)
class Shown:
    """A run as the scene shows it.  numbers : of its frames.  mesh : of the document."""

    numbers: tuple[int, ...]
    model: MorphTargets
    mesh: int


def add_scene(container: Container, runs: list[Shown], frame_rate: float, placement: np.ndarray) -> None:
    """Nodes of all runs, below one that places them about the first, and the animation.

    frame_rate : frame n is shown at (n - first) / frame_rate seconds.  placement : (4, 4) from scene units to those of the file.
    """
    center, first = runs[0].model.origin, runs[0].numbers[0]
    nodes, animation = [_root(center, placement)], _Animation(container)
    switches = [(run.numbers[0] - first - EARLY) / frame_rate for run in runs]
    for index, run in enumerate(runs):
        numbers, model = run.numbers, run.model
        switch, body = len(nodes), len(nodes) + 1
        nodes[0]["children"].append(switch)
        nodes.append({"name": f"frames {numbers[0]} to {numbers[-1]}", "children": [body]} | ({"scale": [0, 0, 0]} if index else {}))
        nodes.append({"mesh": run.mesh, "translation": (model.origin - center).tolist(), "scale": [model.unit] * 3})
        if len(runs) > 1:
            times, shown = _switched(switches, index)
            animation.add((switch, "scale"), times, np.repeat(shown[:, None], 3, axis=1), "STEP")
        if len(model.targets) and len(numbers) > 1:
            animation.add((body, "weights"), (np.array(numbers) - first) / frame_rate, model.weights.ravel(), "LINEAR")
    container.content |= {"scene": 0, "scenes": [{"nodes": [0]}], "nodes": nodes, **animation.content()}


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
