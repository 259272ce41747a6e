"""Where Blender enters the extension; the add-on itself is in refmesh_addon/."""

if __package__:  # not a package when a tool merely finds this file beside the sources
    from .refmesh_addon import register, unregister  # noqa: F401
