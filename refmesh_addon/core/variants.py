"""Arguments that choose between named variants: a misspelled one is refused, never read as another."""

from __future__ import annotations

from collections.abc import Collection


def check_variant(argument: str, value: str, known: Collection[str]) -> None:
    """Raises ValueError, with the list of known variants, when `value` is not one of them. argument : its name, for the message."""
    if value not in known:
        raise ValueError(f"{argument} must be one of {', '.join(map(repr, known))}; got {value!r}")
