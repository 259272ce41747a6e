"""The synthetic sequences. Times run from 0 to 1."""

from __future__ import annotations

import numpy as np

from .bodies import Body, Part, Sequence
from .long_takes import engaged, gears, walk
from .motions import Bend, Chain, Curve, Motion, Rigid, Squash, Twist, Undo
from .shapes import Field, ball, block, capsule, disc, union


def tumble() -> Sequence:
    """One rigid body without symmetry that turns and flies."""
    solid = union(block((0, 0, 0), (1.0, 0.6, 0.35), 0.15), ball((0.9, 0.5, 0.3), 0.55), capsule((-0.8, 0, 0), (-1.1, 0.3, 1.0), 0.25))
    flight = Rigid((1, 2, 0.5), lambda t: 1.6 * t, lambda t: (0.8 * t - 0.4, 0.0, 1.2 * t * (1 - t)))
    return Sequence("tumble", (Body((Part(solid, flight),)),), center=(0, 0, 0.2), reach=2.4, cell=0.09)


BEAM = block((1.5, 0, 0), (1.7, 0.3, 0.2), 0.1)


def bar() -> Sequence:
    """A bar with a round head, twisted and bent at the same time; the head does not show its twist."""
    return _twisted_and_bent("bar", union(BEAM, ball((3.1, 0, 0), 0.42)))


def beam() -> Sequence:
    """The same motion without the head: a twist shows all along it."""
    return _twisted_and_bent("beam", BEAM)


def bend() -> Sequence:
    """The bar of `beam` bent into nearly half a circle."""
    return _deformed(bend.__name__, BEAM, Bend(3.0, lambda t: 2.5 * t))


def twist() -> Sequence:
    """The bar of `beam` twisted by a third of a turn from end to end."""
    return _deformed(twist.__name__, BEAM, Twist(lambda t: 0.65 * t))


def _twisted_and_bent(name: str, solid: Field) -> Sequence:
    return _deformed(name, solid, Chain((Twist(lambda t: 0.5 * t), Bend(3.0, lambda t: 1.5 * t))))


def _deformed(name: str, solid: Field, motion: Motion) -> Sequence:
    return Sequence(name, (Body((Part(solid, motion),)),), center=(1.5, 0, 0.7), reach=2.8, cell=0.09)


def collide() -> Sequence:
    """A ball falls on a block, is squashed while their surfaces are one, and bounces off."""

    def press(time: float) -> float:
        return ramp(time, 0.3, 0.5) - ramp(time, 0.5, 0.7)

    def path(time: float) -> tuple[float, float, float]:
        return 0.0, 0.0, 0.98 - 0.22 * press(time) + 4.0 * max(abs(time - 0.5) - 0.15, 0.0)

    fall = Chain((Squash(lambda t: 1.0 - 0.2 * press(t)), Rigid((0, 0, 1), lambda t: 0.0, path)))
    floor = Body((Part(block((0, 0, -0.7), (1.4, 1.2, 0.7), 0.1)),))
    return Sequence("collide", (Body((Part(ball((0, 0, 0), 1.0), fall),)), floor), center=(0, 0, 0.6), reach=3.0, cell=0.11)


def appear() -> Sequence:
    """A body that slides along, and a second one that is there from the middle on."""
    slide = Rigid((0, 0, 1), lambda t: 0.5 * t, lambda t: (0.8 * t, 0.0, 0.0))
    late = Rigid((0, 1, 0), lambda t: t, lambda t: (0.0, 2.0, 0.5 * t))
    first = Body((Part(block((0, 0, 0), (1.0, 0.5, 0.4), 0.1), slide),))
    second = Body((Part(capsule((-0.5, 0, 0), (0.5, 0, 0), 0.4), late),), start=0.5)
    return Sequence("appear", (first, second), center=(0.4, 0.9, 0.2), reach=2.8, cell=0.09)


# The hand of `clasp` and `grasp`, millimetres.
PALM_RADIUS, PALM_HALF_HEIGHT = 42.0, 9.0
FINGER_LENGTH, FINGER_RADIUS = 88.0, 9.5
FINGER_DIRECTIONS = (-0.6, 0.0, 0.6, np.pi)  # radians about z: three fingers and the thumb
OPEN_CURL, CLOSED_CURL = 1.5, 2.56  # radians; in twelve frames no fingertip moves by more than a finger's width at a time
BALL_RADIUS, BALL_HEIGHT, BALL_LIFT = 55.0, 62.0, 45.0


def clasp() -> Sequence:
    """A hand closes on a ball until they touch, and opens again as the ball rises. Millimetres."""
    return _hand_and_ball("clasp", lambda t: 0.0)


def grasp() -> Sequence:
    """The same while both tilt together: the ball turns with the hand, which its round outline does not show."""
    return _hand_and_ball("grasp", lambda t: 0.5 * ramp(t, 0.2, 0.8))


def _hand_and_ball(name: str, angle: Curve) -> Sequence:
    tilt = Rigid((0.3, 1, 0), angle, lambda t: (0.0, 0.0, 0.0))
    palm = Part(disc(PALM_RADIUS, PALM_HALF_HEIGHT, 6.0), tilt)
    hand = Body((palm, *(_finger(direction, tilt) for direction in FINGER_DIRECTIONS)))
    lift = Rigid((0, 0, 1), lambda t: 0.0, lambda t: (0.0, 0.0, BALL_HEIGHT + BALL_LIFT * (1.0 - _grip(t))))
    caught = Body((Part(ball((0, 0, 0), BALL_RADIUS), Chain((lift, tilt))),))
    return Sequence(name, (hand, caught), center=(0, 0, 55), reach=140.0, cell=4.8)


def _grip(time: float) -> float:
    return ramp(time, 0.0, 0.45) - ramp(time, 0.55, 1.0)


def _finger(direction: float, tilt: Motion) -> Part:
    """A finger that starts at the palm's rim in a direction about z, curls over the palm, and tilts with it."""
    outward = np.array([np.cos(direction), np.sin(direction), 0.0])
    place = Rigid((0, 0, 1), lambda t: direction, lambda t: PALM_RADIUS * outward)
    curl = Bend(FINGER_LENGTH, lambda t: OPEN_CURL + (CLOSED_CURL - OPEN_CURL) * _grip(t))
    solid = capsule((PALM_RADIUS - 2 * FINGER_RADIUS) * outward, (PALM_RADIUS + FINGER_LENGTH) * outward, FINGER_RADIUS)
    return Part(solid, Chain((Undo(place), curl, place, tilt)))


ARM_RADIUS, SHOULDER = 0.15, (0.9, 0.55, 0.0)


def lift() -> Sequence:
    """A trunk whose two arms lie fused along its sides at first, and then lift by half a radian; all of it turns and moves."""
    whole = Rigid((1, 0.2, 0), lambda t: 0.5 * t, lambda t: (0.1 * t, 0.0, 0.1 * t))
    trunk = union(block((0, 0, 0), (1.1, 0.5, 0.32), 0.2), capsule((1.0, 0, 0), (1.4, 0, 0), 0.16), ball((1.6, 0, 0.03), 0.34))
    body = Body((Part(trunk, whole), _lifted_arm(1, whole), _lifted_arm(-1, whole)))
    return Sequence("lift", (body,), center=(0.5, 0, 0.05), reach=2.1, cell=0.07)


def _lifted_arm(side: int, whole: Motion) -> Part:
    """An arm on one side of the trunk, 1 or -1, which it overlaps a little."""
    shoulder, height = np.array(SHOULDER) * [1, side, 1], 0.48 + ARM_RADIUS
    place = Rigid((0, 0, 1), lambda t: 0.0, lambda t: shoulder)
    swing = Rigid((0, 0, 1), lambda t: -0.5 * side * ramp(t, 0.3, 1.0), lambda t: (0.0, 0.0, 0.0))
    upper = capsule((0.9, 0.3 * side, 0), (0.9, height * side, 0), ARM_RADIUS)
    solid = union(upper, capsule((0.9, height * side, 0), (-0.6, height * side, 0), ARM_RADIUS))
    return Part(solid, Chain((Undo(place), swing, place, whole)))


def ramp(time: float, start: float, end: float) -> float:
    """0 before `start`, 1 after `end`, smooth between."""
    share = min(max((time - start) / (end - start), 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)


SEQUENCES = {make.__name__: make for make in (tumble, beam, bar, bend, twist, collide, appear, clasp, grasp, lift, gears, engaged, walk)}
