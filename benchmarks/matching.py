"""Key points of a hand and their partners after it has moved: how many pairs are right, and how many of the possible ones they are.

    python -m benchmarks.matching [--picture FILE.png] [--cell 2.2]

The hand is thin and has fingers that are nearly alike; it tilts and its fingers curl, each by its own angle. Both states have
triangles of their own. A pair is right when the partner lies where the closed-form motion carries the key point, give or take
TOLERANCE. Pairs that exist are those key points that have any key point of the other state there.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from refmesh_addon.core.deformation.keypoints import find_keypoints
from refmesh_addon.core.deformation.matching import Matches, MatchSettings, match_keypoints
from refmesh_addon.core.deformation.patches import PATCH_RADIUS, Patches, surface_patches
from refmesh_addon.core.geometry.mesh import mean_edge_length
from refmesh_addon.core.reference.group import GroupTracks, place_centers
from refmesh_addon.core.reference.mapping import FrameMap
from refmesh_addon.core.settings import ReferenceSettings, TrackingSettings
from refmesh_addon.core.types import TriangleMesh
from sample_scenes.generators.bodies import Body, Part, Sequence
from sample_scenes.generators.motions import Bend, Chain, Motion, Rigid, Undo
from sample_scenes.generators.shapes import ball, block, capsule, union

from .common import tracked

TOLERANCE = 3.0  # mean edge lengths, in which key points suppress each other
FRAMES = 6  # that are tracked between the two states
SETTINGS = TrackingSettings(centers=400, resolution=96)
METHODS = {
    "guided": MatchSettings(),
    "fixed_point": MatchSettings(guided=False),
    "rigid_fit": MatchSettings(guided=False, fixed_point=False),
}
WORDS = {
    "guided": "about the fixed point, guided by the centers",
    "fixed_point": "about the fixed point, among all",
    "rigid_fit": "best rigid fit, among all",
}

# Millimetres and radians. x across the palm, length, radius and curl of each finger.
KNUCKLES = 34.0
FINGERS = ((-28.0, 52.0, 7.5, 0.75), (-9.5, 68.0, 8.5, 0.6), (9.5, 76.0, 9.0, 0.45), (28.5, 66.0, 8.5, 0.3))


def hand(cell: float) -> Sequence:
    """One body: palm with the ball of the thumb, thumb and four fingers.  cell : length of the edges."""
    tilt = Rigid((1, 0.4, 0.2), lambda t: 0.4 * t, lambda t: (8.0 * t, 5.0 * t, 0.0))
    palm = union(block((0, -4, 0), (38, 42, 10), 9), ball((22, -22, 6), 15), capsule((24, -26, 2), (66, 16, 8), 10))
    parts = (Part(palm, tilt), *(_finger(*finger, tilt) for finger in FINGERS))
    return Sequence("hand", (Body(parts),), center=(10, 25, 10), reach=125.0, cell=cell)


def _finger(x: float, length: float, radius: float, curl: float, tilt: Motion) -> Part:
    place = Rigid((0, 0, 1), lambda t: np.pi / 2, lambda t: (x, KNUCKLES, 0.0))
    bend = Bend(0.6 * length, lambda t: curl * (0.2 + t))
    return Part(capsule((x, KNUCKLES - 8, 0), (x, KNUCKLES + length, 0), radius), Chain((Undo(place), bend, place, tilt)))


@dataclass(frozen=True)
class States:
    """The hand before and after, with the key points of both.

    truth : (K, 3) where those of the first truly went.  places : (K, 3) where the tracked centers carry them.
    turns : (K, 3, 3) how the centers turn their surroundings.  tolerance : scene units.
    """

    meshes: tuple[TriangleMesh, TriangleMesh]
    reference: Patches
    frame: Patches
    truth: np.ndarray
    places: np.ndarray
    turns: np.ndarray
    tolerance: float

    @classmethod
    def of(cls, sequence: Sequence) -> States:
        meshes = sequence.frames(FRAMES)
        first, last = meshes[0], meshes[-1]
        length = mean_edge_length(first)
        reference, frame = (surface_patches(mesh, find_keypoints(mesh, length), PATCH_RADIUS * length) for mesh in (first, last))
        states = [state for state, _ in tracked(meshes, SETTINGS)]
        positions, affinity = np.stack([state.centers for state in states]), states[-1].affinity
        group = place_centers(GroupTracks(positions, affinity.weights(), affinity.spacing), ReferenceSettings())
        carrier = FrameMap(first, positions[0], group.affinity, group.spacing)
        body = np.zeros(len(reference.positions), dtype=int)
        truth = sequence.motion(sequence.rest(reference.positions, body, 0.0), body, 1.0)
        places, turns = carrier.to(positions[-1]).vertices, carrier.rotations_to(positions[-1])
        chosen = reference.vertices
        return cls((first, last), reference, frame, truth, places[chosen], turns[chosen], TOLERANCE * length)

    def matches(self, settings: MatchSettings) -> Matches:
        """By one method; one that is not guided is told nothing about the motion."""
        unturned = np.broadcast_to(np.eye(3), self.turns.shape)
        return match_keypoints(self.reference, self.frame, self.places, self.turns if settings.guided else unturned, settings)

    def right(self, matches: Matches) -> np.ndarray:
        """(M,) bool."""
        gaps = np.linalg.norm(self.truth[matches.reference] - self.frame.positions[matches.frame], axis=1)
        return gaps < self.tolerance

    @property
    def possible(self) -> int:
        """How many key points have a partner that is right."""
        gaps = np.linalg.norm(self.truth[:, None] - self.frame.positions, axis=2)
        return int((gaps.min(axis=1) < self.tolerance).sum())


def figures(states: States, matches: Matches) -> dict[str, float]:
    right = states.right(matches)
    precision = float(right.mean()) if len(right) else 0.0
    return {"pairs": len(right), "precision": round(precision, 4), "recall": round(float(right.sum()) / states.possible, 4)}


def draw(states: States, matched: dict[str, Matches], target: Path) -> None:
    """One row for each method: the two hands, right pairs as thin lines and wrong ones as thick red ones."""
    from matplotlib import pyplot  # late: it takes a second, and most runs draw nothing

    figure, axes = pyplot.subplots(len(matched), 1, figsize=(11, 5.2 * len(matched)))
    for axis, (name, matches) in zip(np.atleast_1d(axes), matched.items()):
        _draw_row(axis, states, matches)
        right = states.right(matches)
        axis.set_title(f"{WORDS[name]}: {right.sum()} right, {(~right).sum()} wrong", fontsize=12)
    figure.savefig(target, dpi=90, bbox_inches="tight")
    pyplot.close(figure)


def _draw_row(axis, states: States, matches: Matches) -> None:
    from matplotlib.collections import LineCollection, PolyCollection

    apart = np.array([1.25 * np.ptp(states.meshes[0].vertices[:, 0]), 0.0])
    for number, mesh in enumerate(states.meshes):
        corners = mesh.vertices[mesh.triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        order = np.argsort(corners[:, :, 2].mean(axis=1))  # from far to near: seen from above
        shade = 0.55 + 0.4 * np.clip(normals[order] @ np.array([-0.3, 0.4, 0.87]), 0.0, 1.0)
        axis.add_collection(PolyCollection(corners[order, :, :2] + number * apart, facecolors=np.repeat(shade[:, None], 3, axis=1)))
    ends = states.reference.positions[matches.reference][:, :2], states.frame.positions[matches.frame][:, :2] + apart
    lines, right = np.stack(ends, axis=1), states.right(matches)
    axis.add_collection(LineCollection(lines[right], colors="#1f77b4", linewidths=0.6))
    axis.add_collection(LineCollection(lines[~right], colors="#d62728", linewidths=1.6))
    axis.scatter(*np.concatenate(ends).T, s=5, c="black", zorder=3)
    axis.set_aspect("equal")
    axis.autoscale_view()
    axis.set_axis_off()


def main() -> None:
    """Matches by each method, prints a table and then one line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--picture", type=Path, metavar="FILE.png", help="draw the pairs")
    parser.add_argument("--cell", type=float, default=2.2, help="length of the edges, of a hand 200 long (default: %(default)s)")
    arguments = parser.parse_args()
    states = States.of(hand(arguments.cell))
    matched = {name: states.matches(settings) for name, settings in METHODS.items()}
    results = {name: figures(states, matches) for name, matches in matched.items()}
    for name, result in results.items():
        print(f"{name:12}", *(f"{key} {value:g}" for key, value in result.items()), sep="  ")
    if arguments.picture:
        draw(states, matched, arguments.picture)
    counts = {"key_points": [len(states.reference.vertices), len(states.frame.vertices)], "possible": states.possible}
    print(json.dumps({"benchmark": "matching", **counts, "methods": results}))


if __name__ == "__main__":
    main()
