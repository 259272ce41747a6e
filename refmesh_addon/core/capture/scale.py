"""Whether a capture has the size of what is usually captured, and the factor that would give it that size."""

from __future__ import annotations

import math

USUAL = (0.3, 4.0)  # meters: longest side of a head up to that of a person with arms raised, or of two people
PERSON = 1.7  # meters
FACTORS = (0.001, 0.01, 0.0254, 0.1, 0.3048, 10.0, 100.0, 1000.0)  # millimeters, centimeters, inches, decimeters, feet, and back
ADVICE = ": if this is a person, scale by"


def scale_suggestion(longest: float) -> float:
    """The factor that brings a longest side, in meters, closest to a person's; 1 for one of a usual size or without any.

    >>> scale_suggestion(18.7)
    0.1
    """
    if longest <= 0 or USUAL[0] <= longest <= USUAL[1]:
        return 1.0
    return min(FACTORS, key=lambda factor: abs(math.log(longest * factor / PERSON)))


def scale_note(longest: float) -> str:
    """What is said about an unusual size, with the factor that would mend it; "" for a usual one."""
    factor = scale_suggestion(longest)
    if factor == 1.0:
        return ""
    return f"{meters(longest)} m long{ADVICE} {factor:g}, which makes it {meters(longest * factor)} m"


def meters(length: float) -> str:
    """A length with three significant digits, and without an exponent: "1,770", "0.0123"."""
    return f"{float(f'{length:.3g}'):,.10g}"
