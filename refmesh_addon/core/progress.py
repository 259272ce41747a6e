"""Progress by callback: the core itself stays silent."""

from __future__ import annotations

from collections.abc import Callable

# Called with the share of the caller's work that is done, 0 to 1; may raise `Canceled`.
Progress = Callable[[float], None]


def ignore(share: float) -> None:
    """The default callback, which does nothing."""
