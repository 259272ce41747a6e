"""How far a stage is, as parts of its work tell it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

# (stage, frame number or None, share of the stage from 0 to 1), and True where an earlier run has left that much;
# raises Canceled once the job was canceled.
Notify = Callable[..., None]


@dataclass(frozen=True)
class StageShare:
    """A part of a stage's progress, from `start` to `end`, both shares of the stage."""

    stage: str
    start: float = 0.0
    end: float = 1.0

    def part(self, start: float, end: float) -> StageShare:
        """A part of this part."""
        return StageShare(self.stage, self._at(start), self._at(end))

    def tell(self, notify: Notify, done: float, frame: int | None = None) -> None:
        """Notifies that a share of this part is done, 0 to 1. Raises what `notify` raises."""
        notify(self.stage, frame, self._at(done))

    def skip(self, notify: Notify, done: float) -> None:
        """Notifies that an earlier run has left the results of a share of this part, so that it takes no time."""
        if done > 0:
            notify(self.stage, None, self._at(done), True)

    def _at(self, done: float) -> float:
        return self.start + (self.end - self.start) * done
