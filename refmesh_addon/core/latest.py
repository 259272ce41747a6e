"""What is built once for a group and used for each of its frames: one such thing per process, released before the next is built."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar

from .types import Keyed

Built = TypeVar("Built")
_kept: list[tuple[Callable, Keyed, Any]] = []  # at most one


def latest_only(build: Callable[[Any], Built]) -> Callable[[Any], Built]:
    """`build`, called anew only where the last call in this process, of any such function, was for another input.

    build : takes one `Keyed` input. Frames come group by group, and what is built for one group fits any memory; two do not have to.
    """

    @wraps(build)
    def built(shared: Keyed) -> Built:
        if not _kept or _kept[0][:2] != (build, shared):
            _kept.clear()
            _kept.append((build, shared, build(shared)))
        return _kept[0][2]

    return built
