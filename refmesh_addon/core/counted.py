"""Counts in messages."""

from __future__ import annotations


def counted(count: int, singular: str, plural: str = "") -> str:
    """A number with its noun, as in "1 mesh" and "12 meshes".  plural : of nouns that do not just take an s."""
    return f"{count:,} {singular if count == 1 else plural or singular + 's'}"
