"""Registers the parts of the add-on in the order in which they need each other."""

from contextlib import ExitStack

from . import operators, properties, ui
from .bridge import handlers

PARTS = (properties, operators, ui, handlers)


def register():
    """Each part in order; an error leaves nothing half-registered behind."""
    with ExitStack() as undo:
        for part in PARTS:
            part.register()
            undo.callback(part.unregister)
        undo.pop_all()


def unregister():
    """Each part in reverse order."""
    for part in reversed(PARTS):
        part.unregister()
