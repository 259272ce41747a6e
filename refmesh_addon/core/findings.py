"""What a check of a sequence, and a look at its centers, tell a person; imports nothing heavy, so that panels may use it."""

from __future__ import annotations

from dataclasses import dataclass

SEVERITIES = {"error": "The job stops here", "warning": "The result will suffer", "note": "Taken care of, but good to know"}
# What a center can be coloured by.
FIGURES = {
    "body": "Centers that stay together through the whole sequence have one colour",
    "speed": "Mean distance that a center goes from frame to frame",
    "error": "How much the distances to its neighbours change: large where a surface tears, and where the tracking is wrong",
    "irregularity": "How far a center is from its nearest companion on average: large for strays and thin places",
}


@dataclass(frozen=True)
class Finding:
    """One thing that a person should know. frame : number of the frame to look at.  severity : one of SEVERITIES."""

    kind: str
    severity: str
    frame: int
    words: str
