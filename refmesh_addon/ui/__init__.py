"""Panels and menu entries: they draw, and reach operators by their id only."""

from . import legend, menus, panels, preferences


def register():
    preferences.register()
    panels.register()
    menus.register()
    legend.register()


def unregister():
    legend.unregister()
    menus.unregister()
    panels.unregister()
    preferences.unregister()
