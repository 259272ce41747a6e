"""Independent tasks on all cores, with results that do not depend on the number of processes."""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from itertools import islice
from typing import Any

from ...core.errors import RefMeshError
from .memory import available_memory

MOST_WORKERS = 8  # a task holds the grids and factors of one frame: more processes cost more memory than they save time
QUEUED = 2  # tasks submitted for each process: one at work, one ready
ENDING = 5.0  # seconds that a killed process may take to be gone; it takes milliseconds
POLL = 0.2  # seconds between two calls of `poll` while nothing is done


def one_ahead(make: Callable, items: Iterable) -> Iterator:
    """make(item) for each item in turn; the next one is computed in a thread while the caller works on this one."""
    with ThreadPoolExecutor(1) as thread:
        waiting = deque()
        for item in items:
            waiting.append(thread.submit(make, item))
            if len(waiting) > 1:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


class WorkerDied(RefMeshError):
    """The task number `index` ends the process that does it, also when it is alone."""

    def __init__(self, index: int, subject: str = "a task"):
        remedy = "close other programs, lower --resolution, or export it with fewer triangles"
        super().__init__(f"{subject}: the worker process died, probably out of memory: {remedy}")
        self.index = index


class Workers:
    """A pool of processes that is started with the first tasks and ends with the `with` block."""

    def __init__(self, count: int | None = None):
        self.count = self._most = count or min(_cores(), MOST_WORKERS)
        self._pool: ProcessPoolExecutor | None = None

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def close(self) -> None:
        """Ends the processes, whatever they are doing."""
        if self._pool is not None:
            processes = list((getattr(self._pool, "_processes", None) or {}).values())
            self._pool.shutdown(wait=False, cancel_futures=True)
            for process in processes:  # no result is awaited any more, and worker processes write no files
                process.kill()
            for process in processes:
                process.join(ENDING)

    def fit_memory(self, task_bytes: int) -> bool:
        """Goes on with no more processes than fit into memory at present, but at least one; returns whether these are fewer than the cores.

        task_bytes : that a process needs for its tasks at their peak.
        """
        count = min(max(int(available_memory() // task_bytes), 1), self._most)
        if count < self.count:
            self._restart()
        self.count = count
        return count < self._most

    def map(self, function: Callable, tasks: Iterable[tuple], poll: Callable[[], None]) -> Iterator[tuple[int, Any]]:
        """Yields (index, function(*task)) as tasks are done, in no fixed order.

        function : at module level.  tasks : read only a few ahead of the work, so that a long take does not fill the memory.
        poll : called while waiting; raises Canceled to stop.
        Exceptions of a task are raised here. When a process dies, as it does when memory runs out, the tasks that may have been its are
        done again, each alone; raises WorkerDied for one whose process dies again.
        """
        coming = enumerate(tasks)
        waiting: dict[Future, tuple[int, tuple]] = {}
        try:
            while True:  # ends: each round but those that wait for a process finishes a task
                for index, task in islice(coming, QUEUED * self.count - len(waiting)):
                    waiting[self._submit(function, task)] = index, task
                if not waiting:
                    return
                poll()
                done, _ = wait(waiting, timeout=POLL, return_when=FIRST_COMPLETED)
                for future in sorted(done, key=lambda future: waiting[future][0]):
                    if isinstance(future.exception(), BrokenProcessPool):
                        suspects = sorted(waiting.values(), key=lambda suspect: suspect[0])
                        waiting.clear()
                        yield from self._one_by_one(function, suspects, poll)
                        break
                    yield waiting.pop(future)[0], future.result()
        finally:
            for future in waiting:  # where the loop was left early
                future.cancel()

    def _one_by_one(self, function: Callable, suspects: list[tuple[int, tuple]], poll: Callable[[], None]) -> Iterator[tuple[int, Any]]:
        """Results of tasks with the whole memory for each of them."""
        self._restart()
        for index, task in suspects:
            future = self._submit(function, task)
            while not wait([future], timeout=POLL).done:
                poll()
            if isinstance(future.exception(), BrokenProcessPool):
                self._restart()
                raise WorkerDied(index) from future.exception()
            yield index, future.result()

    def _restart(self) -> None:
        self.close()
        self._pool = None

    def _submit(self, function: Callable, task: tuple) -> Future:
        if self._pool is None:
            self._pool = ProcessPoolExecutor(self.count, multiprocessing.get_context("spawn"), initializer=_die_with_parent)
        try:
            return self._pool.submit(function, *task)
        except BrokenProcessPool as error:  # since the last task
            broken: Future = Future()
            broken.set_exception(error)
            return broken


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _die_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None, "runs in processes of a pool only"

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
