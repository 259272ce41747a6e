"""Panels and menu entries: they draw, and call operators only by id."""

from . import first_start, legend, menus, panels, preferences


def register():
    preferences.register()
    panels.register()
    menus.register()
    legend.register()
    first_start.register()


def unregister():
    first_start.unregister()
    legend.unregister()
    menus.unregister()
    panels.unregister()
    preferences.unregister()
