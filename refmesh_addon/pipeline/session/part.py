"""A part of one step of a job: every n-th of its units of work, which a task of a render farm does while others do the rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from ...core.errors import RefMeshError
from ...core.settings import STAGES
from .stage_share import StageShare

Name = TypeVar("Name")


class PartDone(Exception):
    """The units of a part are in the cache, so that its task can end."""


@dataclass(frozen=True)
class Part:
    """step : the units of work of which this is a part, by their place in the progress of the job.
    number : 1 to count.  count : of the parts, which together do all units.

    Every part goes through the job from its beginning. What comes before the step must be in the cache; what comes after is left alone.
    """

    step: StageShare
    number: int
    count: int

    def __post_init__(self):
        if not 1 <= self.number <= self.count:
            raise RefMeshError(f"part {self.number} of {self.count}: parts are numbered from 1 to their count")

    def own(self, names: Sequence[Name]) -> list[Name]:
        """Those of the step's units that are this part's."""
        return list(names[self.number - 1 :: self.count])

    def begin(self, share: StageShare, complete: bool) -> bool:
        """Whether units with this place in the progress are those of the step.  complete : whether all are in the cache.

        Raises PartDone for units that come after the step, and RefMeshError for earlier ones that are not complete.
        """
        if share == self.step:
            return True
        if _place(share) > _place(self.step):
            raise PartDone
        if not complete:
            raise RefMeshError("an earlier step of the job is not complete: run its tasks first")
        return False


def _place(share: StageShare) -> tuple[int, float]:
    return STAGES.index(share.stage), share.start
