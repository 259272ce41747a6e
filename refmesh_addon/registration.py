"""Registers the modules of the add-on, in the order in which they depend on each other."""

from contextlib import ExitStack

from . import operators, properties, ui
from .bridge import handlers

MODULES = (properties, operators, ui, handlers)


def register():
    """Registers each module in order; an error leaves nothing half-registered behind."""
    with ExitStack() as undo:
        for module in MODULES:
            module.register()
            undo.callback(module.unregister)
        undo.pop_all()


def unregister():
    """Unregisters each module in reverse order."""
    for module in reversed(MODULES):
        module.unregister()
