"""Groups that a running job has finished: read in a thread, and handed out one at a time."""

from __future__ import annotations

from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

from ..core.errors import RefMeshError


class Arrivals:
    """The groups of one job whose objects are still to be shown."""

    def __init__(self, folder: Path):
        self._folder, self._thread = folder, ThreadPoolExecutor(1)
        self._reading: deque[Future] = deque()

    def add(self, index: int) -> None:
        """Begins to read a group."""
        from ..bridge.results.arriving import read_group

        self._reading.append(self._thread.submit(read_group, self._folder, index))

    def next(self):
        """The next group that is read; None while there is none."""
        if not self._reading or not self._reading[0].done():
            return None
        try:
            return self._reading.popleft().result()
        except RefMeshError:  # said when all results are shown at the end
            return None

    def close(self) -> None:
        """Stops requesting anything more."""
        self._thread.shutdown(wait=False, cancel_futures=True)
