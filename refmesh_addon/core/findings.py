"""What the check of a sequence reports and what centers are colored by; imports nothing heavy, so that panels may use it."""

from __future__ import annotations

from dataclasses import dataclass

SEVERITIES = {"error": "The job stops here", "warning": "The result will suffer", "note": "Good to know"}
# Attributes of tracked centers, as `center_attributes` computes them and the viewport shows them.
CENTER_ATTRIBUTES = {
    "body": "Centers that stay together through the whole sequence have one color",
    "speed": "Mean distance that a center moves from frame to frame",
    "error": "How much the distances to its neighbors change: large where a surface tears, and where the tracking is wrong",
    "irregularity": "Mean distance from a center to the nearest other one: large for isolated centers and in thin places",
}
CENTER_LAYOUTS = {name: "(C) number" for name in CENTER_ATTRIBUTES}  # see `array_layout`


@dataclass(frozen=True)
class Finding:
    """One result of a check.

    kind : what was checked, such as "gap" or "scale".  severity : one of SEVERITIES.  frame : number of the frame to look at.
    message : what is wrong and what to do, without the frame.
    """

    kind: str
    severity: str
    frame: int
    message: str
