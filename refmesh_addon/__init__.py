"""RefMesh: reference meshes and constant topology for time-varying mesh sequences.

Nothing is imported here, so that the core and the worker process run where there is no Blender.
"""


def register():
    """Adds operators, panels, properties and the playback handler to Blender."""
    from . import registration

    registration.register()


def unregister():
    """Takes everything out again that `register` added."""
    from . import registration

    registration.unregister()
