"""Tasks in processes: all of them, in any number of processes, with every end they can come to."""

import os
import time
from multiprocessing import connection

import pytest

from refmesh_addon.core.errors import Canceled, RefMeshError
from refmesh_addon.pipeline.session.parallel import MOST_WORKERS, QUEUED, WorkerDied, Workers, one_ahead

PATIENCE = 30.0  # seconds until a test gives up


def power(base, exponent):
    return base**exponent


def own_process(_):
    return os.getpid()


def refuse(frame):
    raise RefMeshError(f"frame {frame} cannot be used")


def die(_):
    os._exit(1)


def square_but_die_at_three(k):
    return os._exit(1) if k == 3 else k * k


def square_but_die_once(k, mark):
    if k == 3 and not os.path.exists(mark):
        open(mark, "w").close()
        os._exit(1)
    return k * k


def sleep(seconds):
    time.sleep(seconds)


def nothing():
    pass


@pytest.fixture(scope="module")
def pair():
    with Workers(2) as workers:
        yield workers


def test_every_task_is_done_and_comes_back_with_its_index(pair):
    tasks = [(base, 3) for base in range(25)]
    assert dict(pair.map(power, tasks, nothing)) == {index: index**3 for index in range(25)}


def test_no_tasks_start_no_process():
    with Workers(2) as workers:
        assert list(workers.map(power, [], nothing)) == []
        assert workers._pool is None


def test_tasks_run_elsewhere_in_no_more_processes_than_asked_for(pair):
    processes = set(dict(pair.map(own_process, [(k,) for k in range(20)], nothing)).values())
    assert os.getpid() not in processes
    assert 1 <= len(processes) <= 2


def test_tasks_are_read_only_a_few_ahead(pair):
    taken = []

    def tasks():
        for number in range(40):
            taken.append(number)
            yield number, 2

    done = 0
    for _ in pair.map(power, tasks(), nothing):
        done += 1
        assert len(taken) <= done + QUEUED * pair.count + 1
    assert done == len(taken) == 40


def test_what_a_task_raises_is_raised_here(pair):
    with pytest.raises(RefMeshError, match="frame 7 cannot be used"):
        list(pair.map(refuse, [(7,)], nothing))
    assert dict(pair.map(power, [(2, 2)], nothing)) == {0: 4}, "and the processes go on"


def test_poll_is_called_while_waiting_and_stops_the_work():
    calls = []

    def poll():
        calls.append(time.monotonic())
        if len(calls) == 3:
            raise Canceled

    with Workers(1) as workers:
        with pytest.raises(Canceled):
            list(workers.map(sleep, [(10 * PATIENCE,)], poll))
        process = next(iter(workers._pool._processes.values()))
    assert connection.wait([process.sentinel], PATIENCE), "a task that nobody waits for has ended"
    assert len(calls) == 3


def test_a_process_that_dies_is_told_in_words():
    with Workers(1) as workers, pytest.raises(RefMeshError, match="worker process died"):
        list(workers.map(die, [(0,)], nothing))


def test_only_the_task_that_ends_its_process_is_to_blame():
    done = {}
    with Workers(2) as workers:
        with pytest.raises(WorkerDied) as error:
            done.update(pair for pair in workers.map(square_but_die_at_three, [(k,) for k in range(6)], nothing))
        assert error.value.index == 3
        assert dict(workers.map(power, [(2, 2)], nothing)) == {0: 4}, "and others can be done"


def test_a_process_that_is_killed_once_costs_no_task(tmp_path):
    with Workers(2) as workers:
        tasks = [(k, str(tmp_path / "killed")) for k in range(6)]
        assert dict(workers.map(square_but_die_once, tasks, nothing)) == {k: k * k for k in range(6)}


def test_there_is_at_least_one_process_and_not_too_many():
    assert 1 <= Workers().count <= MOST_WORKERS
    assert Workers(3).count == 3


def test_processes_fit_the_memory(monkeypatch):
    """Fewer where each needs much, at least one, and as many as before once there is enough again."""
    monkeypatch.setattr("refmesh_addon.pipeline.session.parallel.available_memory", lambda: 10_000)
    with Workers(3) as workers:
        assert not workers.fit_memory(1000) and workers.count == 3
        assert set(dict(workers.map(power, [(2, 2)], nothing)).values()) == {4}
        for need, count in ((4000, 2), (9000, 1), (20_000, 1), (3000, 3)):
            assert workers.fit_memory(need) == (count < 3) and workers.count == count
        assert dict(workers.map(power, [(2, 3)], nothing)) == {0: 8}, "in a pool of the new size"


def test_one_ahead_makes_each_item_once_in_order_and_only_one_too_early():
    made = []

    def make(item):
        made.append(item)
        return 10 * item

    for count, result in enumerate(one_ahead(make, range(5)), 1):
        assert result == 10 * (count - 1)
        assert len(made) <= count + 1
    assert made == list(range(5))


def test_one_ahead_fails_where_the_item_would_have_come():
    found = one_ahead(lambda item: 1 // item, [1, 0, 2])
    assert next(found) == 1
    with pytest.raises(ZeroDivisionError):
        next(found)
