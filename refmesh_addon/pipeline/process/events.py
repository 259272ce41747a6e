"""The events that a worker sends to its parent, as lines of JSON."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, fields

FINAL_KINDS = ("done", "failed", "canceled")


@dataclass(frozen=True)
class Event:
    """kind : "progress", "warning", "group", or how the job ended: "done", "failed", "canceled".

    message : one line for a person; for a group, its index: it can be shown now.
    share : of the whole job, 0 to 1.  left : seconds until it is done, None where nothing is known.
    frame : number of the frame that is worked on, None where there are several.
    """

    kind: str
    message: str = ""
    stage: str = ""
    frame: int | None = None
    share: float = 0.0
    left: float | None = None

    @property
    def is_final(self) -> bool:
        """True for the last event of a job."""
        return self.kind in FINAL_KINDS

    def to_line(self) -> str:
        """One line of ASCII JSON, without the line break."""
        return json.dumps(asdict(self))

    @classmethod
    def from_line(cls, line: str) -> Event | None:
        """The event of a line; None for a line that is not one, as a library may print past our redirection."""
        try:
            values = json.loads(line)
        except ValueError:
            return None
        names = {item.name for item in fields(cls)}
        return cls(**values) if isinstance(values, dict) and "kind" in values and names.issuperset(values) else None
