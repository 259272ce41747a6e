"""Saves a scene that can be moved together with its results."""

import bpy
from bpy.props import BoolProperty, StringProperty

from ..bridge.scene import timeline as scene
from ..core.errors import RefMeshError
from .common import SceneOperator, absolute, reporting


class REFMESH_OT_save_scene(SceneOperator, bpy.types.Operator):
    """Save the scene with all paths relative to it, so that its folder can be moved"""

    bl_idname = "refmesh.save_scene"
    bl_label = "Save Scene"

    filepath: StringProperty(name="File", description="The .blend file to write", subtype="FILE_PATH")
    among_results: BoolProperty(
        name="Among Results",
        description="The file lies in an output folder: a scene there that is not as it was saved by this operator is renamed",
        options={"HIDDEN", "SKIP_SAVE"},
    )

    @reporting
    def execute(self, context):
        from ..pipeline.session.saved_scenes import record_scene, rename_changed

        path = absolute(self.filepath)
        if not self.among_results:
            scene.save_scene(path)
            return {"FINISHED"}
        try:
            kept = rename_changed(path)
        except OSError as error:
            raise RefMeshError(f"{path}: cannot be renamed ({error.strerror or error}); move it away") from error
        scene.save_scene(path)
        record_scene(path)
        if kept is not None:
            self.report({"WARNING"}, f"{path.name} was changed since a script saved it; it is kept as {kept.name}")
        return {"FINISHED"}


CLASSES = (REFMESH_OT_save_scene,)
