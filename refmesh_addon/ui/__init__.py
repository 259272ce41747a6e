"""Panels and menu entries: they draw, and reach operators by their id only."""

from . import menus, panels, preferences


def register():
    preferences.register()
    panels.register()
    menus.register()


def unregister():
    menus.unregister()
    panels.unregister()
    preferences.unregister()
