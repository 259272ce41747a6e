"""How every stage does its work: independent units, computed on all cores, with each result kept in the cache.

A stage gives its units, a function that computes one, and the type of its results. Results of earlier runs are not computed
again, and each new one is saved at once, so that a job that was canceled or killed continues where it stopped.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Generic, TypeVar

from ...core.arrays import Result
from ...core.errors import RefMeshError
from .cache import Cache
from .parallel import WorkerDied
from .part import PartDone
from .session import Session
from .stage_share import StageShare

Name = TypeVar("Name")


@dataclass(frozen=True)
class WorkUnit:
    """One piece of a stage's work, which any process on any machine can compute.

    entry : name of its result in the cache.  key : digest of all that the result depends on.
    arguments : gives the arguments of the stage's function by value: arrays, numbers, texts and dataclasses of these. It is called
    when a process is about to be free, so that those of a long take are never in memory together.
    frame : number of the frame that progress names, None where there are several.  subject : what an error names, such as a file.
    """

    entry: str
    key: str
    arguments: Callable[[], tuple]
    frame: int | None = None
    subject: str = ""


class CachedResults(Mapping[Name, Result], Generic[Name, Result]):
    """Results of units by name, read from the cache on demand; only the last one stays in memory."""

    def __init__(self, cache: Cache, units: Mapping[Name, WorkUnit], kind: type[Result]):
        self._cache, self._units, self._kind = cache, units, kind
        self._latest: tuple[Name, Result] | None = None

    def __getitem__(self, name: Name) -> Result:
        """Raises RefMeshError, naming the file, when the entry has disappeared during the run."""
        if self._latest is None or self._latest[0] != name:
            self._latest = (name, self._read(self._units[name]))
        return self._latest[1]

    def __contains__(self, name: object) -> bool:
        return name in self._units

    def __iter__(self) -> Iterator[Name]:
        return iter(self._units)

    def __len__(self) -> int:
        return len(self._units)

    def _read(self, unit: WorkUnit) -> Result:
        result = self._cache.load_result(unit.entry, unit.key, self._kind)
        if result is None:
            raise RefMeshError(f"{self._cache.path(unit.entry, unit.key)}: cannot be read again; start the run again")
        return result


def cached_map(
    session: Session,
    function: Callable[..., Result],
    units: Mapping[Name, WorkUnit],
    kind: type[Result],
    share: StageShare,
    failed: Callable[[Name, RefMeshError], None] | None = None,
) -> CachedResults[Name, Result]:
    """Computes all units whose results are not in the cache, in any order, and returns the results of all.

    function : at module level; result of type `kind`, which `to_arrays` can pack.  share : of the stage's progress.
    failed : called with the name of a unit whose function raised a RefMeshError, and the error; the unit has no result, and the
    next run tries it again. Without it the first RefMeshError ends the map.
    Raises what `session.notify` raises, which is called several times a second; PartDone where the session has a part of these units,
    or of earlier ones, to do.
    """
    done = set(finished_units(session, function, units, kind, share, failed))
    return CachedResults(session.cache, {name: unit for name, unit in units.items() if name in done}, kind)


def finished_units(
    session: Session,
    function: Callable[..., Result],
    units: Mapping[Name, WorkUnit],
    kind: type[Result],
    share: StageShare,
    failed: Callable[[Name, RefMeshError], None] | None = None,
) -> Iterator[Name]:
    """Does what `cached_map` does, and yields the name of each unit as soon as its result is in the cache; arguments as there."""
    own = _own_units(session, units, share)
    missing = [name for name in own if _missing(session, units[name], kind, share)]
    share.skip(session.notify, 1 - len(missing) / max(len(own), 1))
    yield from units.keys() - set(missing)
    progress = _Progress(session, share, len(own), len(own) - len(missing))
    for name, outcome in _outcomes(session, function if failed is None else partial(_attempted, function), units, missing, progress.tell):
        if failed is None and isinstance(outcome, WorkerDied):
            raise outcome
        if failed is not None and isinstance(outcome, RefMeshError):
            failed(name, outcome)
        else:
            session.cache.save_result(units[name].entry, units[name].key, outcome)
            yield name
        progress.advance(units[name].frame)
    if session.part is not None and share == session.part.step:
        raise PartDone


def _outcomes(
    session: Session, function: Callable, units: Mapping[Name, WorkUnit], names: list[Name], tell: Callable[[], None]
) -> Iterator[tuple[Name, Any]]:
    """(name, what the function returns) of each unit; WorkerDied, which names it, of one that ends the process that works on it."""
    left = list(names)
    while left:  # each round but the last leaves a unit that ends its process behind
        done = set()
        try:
            for index, outcome in session.workers.map(function, (units[name].arguments() for name in left), tell):
                done.add(left[index])
                yield left[index], outcome
            return
        except WorkerDied as died:
            name = left[died.index]
            yield name, WorkerDied(died.index, units[name].subject or units[name].entry)
            left = [other for other in left if other not in done and other != name]


def _own_units(session: Session, units: Mapping[Name, WorkUnit], share: StageShare) -> list[Name]:
    """The units to see to: all of them, or those of the session's part, or none of a step before. Raises what `Part.begin` raises."""
    if session.part is None:
        return list(units)
    complete = all(session.cache.path(unit.entry, unit.key).exists() for unit in units.values())
    return session.part.own(list(units)) if session.part.begin(share, complete) else []


def _missing(session: Session, unit: WorkUnit, kind: type, share: StageShare) -> bool:
    share.tell(session.notify, 0.0)
    return not session.cache.holds_result(unit.entry, unit.key, kind)


@dataclass
class _Progress:
    session: Session
    share: StageShare
    total: int
    done: int

    def tell(self) -> None:
        self.share.tell(self.session.notify, self.done / max(self.total, 1))

    def advance(self, frame: int | None) -> None:
        self.done += 1
        self.share.tell(self.session.notify, self.done / self.total, frame)


def _attempted(function: Callable, *arguments: Any) -> Any:
    """What the function returns, or the RefMeshError that it raises."""
    try:
        return function(*arguments)
    except RefMeshError as error:
        return error
