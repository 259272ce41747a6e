"""What a check of a sequence tells a person."""

from __future__ import annotations

from dataclasses import dataclass

SEVERITIES = {"error": "The job stops here", "warning": "The result will suffer", "note": "Taken care of, but good to know"}


@dataclass(frozen=True)
class Finding:
    """One thing that a person should know. frame : number of the frame to look at.  severity : one of SEVERITIES."""

    kind: str
    severity: str
    frame: int
    words: str
