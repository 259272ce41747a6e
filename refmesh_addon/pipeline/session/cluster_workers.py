"""A Dask cluster as the workers of a job: the same tasks as in processes of this machine, and the same results."""

from __future__ import annotations

import pickle
import queue
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from itertools import islice
from typing import Any
from uuid import uuid4

from ...core.errors import RefMeshError
from .cluster_code import code_archive, sendable
from .cluster_task import FAILED, NO_FILES, Answer, Task
from .parallel import POLL, QUEUED

CONNECT_TIMEOUT = 20.0  # seconds until a scheduler counts as absent
NO_WORKERS_TIMEOUT = 300.0  # seconds without any worker after which the job gives up; a farm may be starting some
COUNT_INTERVAL = 1.0  # seconds between two looks at how many workers there are
LARGE_TASK = "1GiB"  # from which on Dask warns; the arrays of a frame are always above its own limit


class ClusterWorkers:
    """The workers of a Dask scheduler, connected with the `with` block.

    address : of the scheduler, such as tcp://host:8786.  warn : called once for each difference between a worker and this machine.
    Dask repeats the tasks of a worker that dies on another one.
    """

    def __init__(self, address: str, warn: Callable[[str], None] = lambda message: None):
        self._address, self._warn, self._warned = address, warn, {""}
        self._client: Any = None
        self._run: Callable[[bytes], bytes] | None = None
        self._send_files = False
        self._count, self._counted, self._had_workers = 0, float("-inf"), time.monotonic()

    def __enter__(self) -> ClusterWorkers:
        """Raises RefMeshError when no scheduler answers, and ImportError when Dask is not installed."""
        import cloudpickle
        import dask
        from distributed import Client

        from . import cluster_code

        dask.config.set({"distributed.admin.large-graph-warning-threshold": LARGE_TASK})
        cloudpickle.register_pickle_by_value(cluster_code)
        try:
            self._client = Client(self._address, timeout=CONNECT_TIMEOUT, set_as_default=False)
            digest, archive = code_archive()
            plugin, self._run = sendable(digest, archive)
            self._client.register_plugin(plugin, name=f"refmesh-{digest}")
        except (OSError, ValueError) as error:
            self.close()
            raise self._error(f"no Dask scheduler answers there ({error}); start one with 'dask scheduler'") from error
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def close(self) -> None:
        """Ends the connection; the cluster goes on for others."""
        if self._client is not None:
            with suppress(OSError, TimeoutError):  # a scheduler that is gone
                self._client.close(timeout=CONNECT_TIMEOUT)

    @property
    def count(self) -> int:
        """Workers at present. Raises RefMeshError when there have been none for long."""
        now = time.monotonic()
        if now - self._counted > COUNT_INTERVAL:
            self._count, self._counted = self._counted_workers(), now
        if self._count:
            self._had_workers = now
        elif now - self._had_workers > NO_WORKERS_TIMEOUT:
            raise self._error("it has no workers; start some with 'dask worker', and start the job again to continue")
        return self._count

    def _counted_workers(self) -> int:
        self._check()
        try:
            return len(self._client.scheduler_info()["workers"])
        except OSError as error:  # it was lost a moment ago
            raise self._lost() from error

    def fit_memory(self, task_bytes: int) -> bool:
        """Leaves the cluster as it is: Dask limits the memory of its workers itself."""
        return False

    def map(self, function: Callable, tasks: Iterable[tuple], poll: Callable[[], None]) -> Iterator[tuple[int, Any]]:
        """Yields (index, function(*task)) as `Workers.map` does.

        Paths among the arguments are files that the function reads: where a worker does not see the same file, it is sent.
        Raises RefMeshError also when the scheduler is lost.
        """
        coming, waiting = enumerate(tasks), {}
        done: queue.SimpleQueue = queue.SimpleQueue()
        try:
            while True:
                for index, arguments in islice(coming, max(QUEUED * max(self.count, 1) - len(waiting), 0)):
                    self._submit(index, Task.of(function, arguments), waiting, done)
                if not waiting:
                    return
                poll()
                self._check()
                with suppress(queue.Empty):
                    future = done.get(timeout=POLL)
                    index, task = waiting.pop(future)
                    answer = self._answer(future)
                    if answer.outcome == NO_FILES:
                        self._send_files = True
                        self._submit(index, task, waiting, done)
                    else:
                        yield index, answer.value
        finally:
            if waiting and self._client.status == "running":  # where the loop was left early
                with suppress(OSError):
                    self._client.cancel(list(waiting), force=True)

    def _submit(self, index: int, task: Task, waiting: dict, done: queue.SimpleQueue) -> None:
        packed = (task.with_files() if self._send_files else task).packed()
        future = self._client.submit(self._run, packed, key=f"{task.name}-{uuid4()}", pure=False)
        waiting[future] = index, task
        future.add_done_callback(done.put)

    def _answer(self, future: Any) -> Answer:
        from concurrent.futures import CancelledError

        from distributed.scheduler import KilledWorker

        try:
            answer = pickle.loads(future.result())
        except KilledWorker as error:
            raise self._error("several workers died of the same task, probably out of memory: lower --resolution") from error
        except (CancelledError, OSError) as error:
            raise self._lost() from error
        finally:
            future.release()
        if answer.note not in self._warned:
            self._warned.add(answer.note)
            self._warn(answer.note)
        if answer.outcome == FAILED:
            raise answer.value
        return answer

    def _check(self) -> None:
        if self._client.status != "running":
            raise self._lost()

    def _lost(self) -> RefMeshError:
        return self._error("the connection is lost; what is done is kept, start the job again to continue")

    def _error(self, reason: str) -> RefMeshError:
        return RefMeshError(f"--scheduler {self._address}: {reason}")
