"""Sequences that are meant for a hundred frames and more, for meshes that serve a whole take. Times run from 0 to 1."""

from __future__ import annotations

import numpy as np

from .bodies import Body, Part, Sequence
from .motions import Bend, Chain, Curve, Rigid, Twist, Undo
from .shapes import Field, ball, block, capsule, gear, union

TEETH, GEAR_RADIUS, TOOTH, GEAR_HALF_HEIGHT = 8, 1.0, 0.16, 0.35
CLEARANCE = 0.16  # between the teeth of two gears: wider than a cell, so that their surfaces stay two


def gears() -> Sequence:
    """Two gears of eight teeth that turn against each other, each by half a turn; no frame shows them farther apart than another."""
    return _gears("gears", CLEARANCE)


def engaged() -> Sequence:
    """The same without clearance: in most frames the two have one surface, so that nothing but their motion shows that they are two."""
    return _gears("engaged", 0.0)


def _gears(name: str, clearance: float) -> Sequence:
    solid, distance = gear(GEAR_RADIUS, TOOTH, TEETH, GEAR_HALF_HEIGHT, 0.1), 2 * GEAR_RADIUS + clearance
    first = Rigid((0, 0, 1), lambda t: np.pi * t, lambda t: (0.0, 0.0, 0.0))
    second = Rigid((0, 0, 1), lambda t: np.pi / TEETH - np.pi * t, lambda t: (distance, 0.0, 0.0))
    bodies = (Body((Part(solid, first),)), Body((Part(solid, second),)))
    return Sequence(name, bodies, center=(distance / 2, 0, 0), reach=2.6, cell=0.09)


# The figure of `walk`: its spine is the x axis, upwards, and it looks along z.
HIP, SHOULDER = (-1.15, 0.27, 0.0), (0.7, 0.55, 0.0)
STRIDES = 4  # of each leg in the take


def walk() -> Sequence:
    """A figure that walks on the spot, twists its trunk, touches its chest with one hand and turns about itself."""
    twist = Twist(lambda t: 0.25 * np.sin(4 * np.pi * t))
    turn = Rigid((1, 0, 0), lambda t: 2.0 * np.pi * t, lambda t: (0.05 * np.sin(4 * STRIDES * np.pi * t), 0.0, 0.0))
    whole = (twist, turn)
    trunk = union(block((0, 0, 0), (1.1, 0.5, 0.32), 0.2), capsule((1.0, 0, 0), (1.4, 0, 0), 0.16), ball((1.6, 0, 0.03), 0.34))
    nose = ball((1.6, 0, 0.38), 0.12)
    swing = lambda phase: lambda t: 0.1 + 0.35 * (1.0 + np.sin(2 * np.pi * (STRIDES * t + phase)))
    legs = [_limb(side * np.array(HIP) * [side, 1, 1], np.pi, 1.6, 0.21, 0.5, swing(phase), whole) for side, phase in ((1, 0.0), (-1, 0.5))]
    waving, touching = swing(0.25), lambda t: 0.15 + 2.6 * np.sin(np.pi * t) ** 2
    arms = [
        _limb(np.array(SHOULDER), np.pi / 2, 1.25, 0.16, 0.4, waving, whole),
        _limb(np.array(SHOULDER) * [1, -1, 1], -np.pi / 2, 1.25, 0.16, 0.8, touching, whole),
    ]
    return Sequence("walk", (Body((Part(union(trunk, nose), Chain(whole)), *legs, *arms)),), center=(-0.4, 0, 0), reach=3.0, cell=0.1)


def _limb(root: np.ndarray, direction: float, length: float, radius: float, joint: float, curl: Curve, whole: tuple) -> Part:
    """A limb that leaves the trunk at `root`, points in a direction about z, bends forward over its first part, and moves with all.

    joint : length of the part that bends.  curl : angle of the bend.
    """
    place = Rigid((0, 0, 1), lambda t: direction, lambda t: root)
    outward = np.array([np.cos(direction), np.sin(direction), 0.0])
    solid: Field = capsule(root - 2 * radius * outward, root + length * outward, radius)
    return Part(solid, Chain((Undo(place), Bend(joint, curl), place, *whole)))
