"""Alembic and USD files, one animated object of which is to become a sequence."""

import bpy
from bpy.props import BoolProperty, StringProperty

from ..bridge.formats import registry
from ..core.errors import RefMeshError
from .common import SceneOperator, absolute, reporting


class REFMESH_OT_import_scene(SceneOperator, bpy.types.Operator):
    """Import an Alembic or USD file and make one mesh object of it the active object; Use Active Object makes it a sequence"""

    bl_idname = "refmesh.import_scene"
    bl_label = "Import Alembic or USD"
    bl_options = {"UNDO"}

    filepath: StringProperty(name="File", description="An Alembic or USD file", subtype="FILE_PATH")
    filter_glob: StringProperty(default=";".join(f"*{extension}" for extension in registry.loaded_extensions()), options={"HIDDEN"})
    object: StringProperty(
        name="Object", description="Which object of an .abc or .usd file; needed where there are several", options={"SKIP_SAVE"}
    )
    empty_scene: BoolProperty(
        name="Empty Scene", description="Remove everything from the scene first; meant for scripts", options={"HIDDEN", "SKIP_SAVE"}
    )

    @reporting
    def execute(self, context):
        from ..bridge.scene import timeline as scene

        path = absolute(self.filepath)
        if self.empty_scene:
            scene.empty_scene()
        present = set(context.scene.objects)
        registry.load(path)
        meshes = {member.name: member for member in context.scene.objects if member.type == "MESH" and member not in present}
        if self.object not in meshes and (self.object or len(meshes) != 1):
            content = f"has the mesh objects {', '.join(sorted(meshes))}" if meshes else "has no mesh object"
            raise RefMeshError(f"{path}: {content}; name one of them with --object")
        context.view_layer.objects.active = meshes[self.object] if self.object else next(iter(meshes.values()))
        return {"FINISHED"}


CLASSES = (REFMESH_OT_import_scene,)
