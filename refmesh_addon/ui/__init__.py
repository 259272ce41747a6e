"""Panels and menu entries: they draw, and call operators only by id."""

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
