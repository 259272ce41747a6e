"""What the work of every stage needs: a cache, processes, and somebody to tell how far it is."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from .cache import Cache
from .part import Part
from .stage_share import Notify


class WorkerPool(Protocol):
    """Who does the work: processes of this machine (`Workers`) or a cluster (`ClusterWorkers`)."""

    count: int

    def fit_memory(self, task_bytes: int) -> bool:
        """Goes on with no more processes than fit in memory, where each needs so many bytes; returns whether these are fewer."""

    def map(self, function: Callable, tasks: Iterable[tuple], poll: Callable[[], None]) -> Iterator[tuple[int, Any]]:
        """Yields (index, function(*task)) as tasks are done, in no fixed order; calls `poll` while it waits."""


@dataclass
class Session:
    """One run: where results go, who does the work, and whom to tell.

    output : folder.  cache : in it.  part : of one step, where other processes do the rest; None for all work.
    """

    output: Path
    cache: Cache
    workers: WorkerPool
    notify: Notify
    part: Part | None = field(default=None, kw_only=True)
