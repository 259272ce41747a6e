"""One task as it travels to a worker of a cluster, runs there, and comes back."""

from __future__ import annotations

import os
import pickle
import socket
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ...core.errors import RefMeshError
from ...io.appearance import files_beside, files_read

VERSIONED = ("numpy", "scipy", "trimesh", "PIL")  # packages with which the last bits of results may change
PRESENT = ("xatlas",)  # those without which a worker would do the same work in another way
THREADS = "OMP_NUM_THREADS"  # in the environment: sums depend on how many threads share them; jobs and Dask's nannies set it to 1
DONE, FAILED, NO_FILES = "done", "failed", "no files"


@dataclass(frozen=True)
class InputFile:
    """A file that a task reads.

    size, time : by which a worker knows that it sees the same file, as in a shared folder.
    contents : for workers that do not: its bytes and those of the files that are read beside it, by name relative to its folder; None
    for files that only have to be there.
    """

    path: str
    size: int
    time: int
    contents: dict[str, bytes | None] | None = None

    @classmethod
    def of(cls, path: Path) -> InputFile:
        """Raises RefMeshError, naming the file, when it is gone."""
        try:
            state = path.stat()
        except OSError as error:
            raise RefMeshError(f"{path}: cannot be read ({error.strerror or error})") from error
        return cls(str(path), state.st_size, state.st_mtime_ns)

    def filled(self) -> InputFile:
        """With its contents. Raises RefMeshError, naming the file, when it cannot be read."""
        path = Path(self.path)
        try:
            data = path.read_bytes()
        except OSError as error:
            raise RefMeshError(f"{path}: cannot be read ({error.strerror or error})") from error
        contents: dict[str, bytes | None] = {name: None for name, *_ in files_beside(path)}
        contents |= files_read(data, path)
        return replace(self, contents={**contents, path.name: data})

    def is_shared(self) -> bool:
        """Whether this machine sees the same file."""
        try:
            state = Path(self.path).stat()
        except OSError:
            return False
        return (state.st_size, state.st_mtime_ns) == (self.size, self.time)


@dataclass(frozen=True)
class Task:
    """A call: function at module level, its arguments, where InputFile stands for a path; packages : versions on the sender's machine."""

    function: Callable
    arguments: tuple
    packages: dict[str, str]

    @classmethod
    def of(cls, function: Callable, arguments: tuple) -> Task:
        """Raises RefMeshError when a file that the call would read is gone."""
        return cls(function, tuple(InputFile.of(item) if isinstance(item, Path) else item for item in arguments), packages())

    def with_files(self) -> Task:
        """The same with all files in it, for workers that do not share them."""
        return replace(self, arguments=tuple(item.filled() if isinstance(item, InputFile) else item for item in self.arguments))

    @property
    def name(self) -> str:
        """Of the function, as Dask's dashboard shows it."""
        return (self.function.args[0] if isinstance(self.function, partial) else self.function).__name__

    def packed(self) -> bytes:
        """For the way to a worker."""
        return pickle.dumps(self, protocol=pickle.HIGHEST_PROTOCOL)


@dataclass(frozen=True)
class Answer:
    """outcome : DONE; FAILED with a RefMeshError; NO_FILES, where the worker has not got the files.  value : result or error.
    note : what is different on the worker; "" for nothing.
    """

    outcome: str
    value: Any = None
    note: str = ""


def execute(packed: bytes) -> bytes:
    """Runs a task on a worker. Returns the pickled `Answer`."""
    return pickle.dumps(_answer(pickle.loads(packed)), protocol=pickle.HIGHEST_PROTOCOL)


def packages() -> dict[str, str]:
    """Version of each package that results depend on, as far as it is installed, and the number of threads."""
    versions = {name: import_module(name).__version__ for name in VERSIONED if find_spec(name)}
    versions[THREADS] = os.environ.get(THREADS, "all cores")
    return versions | {name: "" for name in PRESENT if find_spec(name)}


def _answer(task: Task) -> Answer:
    missing, others = _differences(tuple(sorted(task.packages.items())))
    if missing:
        return Answer(FAILED, RefMeshError(f"Dask worker on {socket.gethostname()}: {missing}"))
    names: dict[str, str] = {}  # of copies of files -> of the files themselves
    with ExitStack() as stack:
        arguments = []
        for item in task.arguments:
            if isinstance(item, InputFile) and item.contents is None and not item.is_shared():
                return Answer(NO_FILES)
            arguments.append(_local(item, stack, names) if isinstance(item, InputFile) else item)
        try:
            value = task.function(*arguments)
        except RefMeshError as error:
            return Answer(FAILED, _renamed(error, names), others)
    return Answer(DONE, _renamed(value, names) if isinstance(value, RefMeshError) else value, others)


def _local(item: InputFile, stack: ExitStack, names: dict[str, str]) -> Path:
    """Where this machine has the file; one that was sent is written to a folder of its own first."""
    path = Path(item.path)
    if item.contents is None:
        return path
    folder = Path(stack.enter_context(TemporaryDirectory(prefix="refmesh-")))
    for name, data in item.contents.items():
        copy = folder / name
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_bytes(data or b"")
    names[str(folder)] = str(path.parent)
    return folder / path.name


def _renamed(error: RefMeshError, names: dict[str, str]) -> RefMeshError:
    message = str(error)
    for copy, name in names.items():
        message = message.replace(copy, name)
    return RefMeshError(message)


@lru_cache(maxsize=8)
def _differences(needed: tuple[tuple[str, str], ...]) -> tuple[str, str]:
    """What keeps this machine from working, and what may change the last bits of results; "" for nothing."""
    here = packages()
    missing = [name for name, _ in needed if name not in here]
    other = [f"{name} {here[name]} in place of {version}" for name, version in needed if here.get(name, version) != version]
    reason = f"the Python packages {', '.join(missing)} are missing there; install them as on this machine" if missing else ""
    return reason, f"Dask worker on {socket.gethostname()}: {', '.join(other)}; results may differ in their last digits" if other else ""
