"""A mesh of the user's own in place of the reference mesh."""

import bpy

from ..core.errors import RefMeshError
from ..core.settings import OVER_REFERENCE
from ..properties.selection import sequence_object
from .common import SequenceOperator, absolute, reporting


class REFMESH_OT_use_own_mesh(SequenceOperator, bpy.types.Operator):
    """Deform the active mesh, made over the current frame or the reference mesh, to the whole take in place of a reconstructed reference \
mesh; its polygons, UV maps and vertex groups stay"""

    bl_idname = "refmesh.use_own_mesh"
    bl_label = "Use Active Object as Mesh"
    bl_options = {"UNDO"}

    @classmethod
    def poll_failure(cls, context):
        failure = super().poll_failure(context)
        target, owner = context.active_object, sequence_object(context)
        if not failure and (target is None or target.type != "MESH" or target in (owner, owner.refmesh.centers)):
            return "select the mesh that was made over the current frame or the reference mesh"
        return failure

    @reporting
    def execute(self, context):
        from ..bridge.results.made_over import made_over
        from ..bridge.results.own_mesh import keep_own_mesh
        from ..bridge.sequence.raw_sequence import frame_at

        owner, target = sequence_object(context), context.active_object
        state = owner.refmesh
        if not state.output:
            raise RefMeshError("choose an output folder first: the mesh is written there for the job")
        context.view_layer.update()  # a script may have moved the object just before
        over = made_over(owner, target)
        path = keep_own_mesh(owner, target, over.to_source, absolute(state.output))
        state.settings.mesh = str(path)
        state.settings.mesh_frame = OVER_REFERENCE if over.reference else int(frame_at(owner, context.scene.frame_current).name)
        made = "made over the reference mesh" if over.reference else f"made over frame {state.settings.mesh_frame}"
        self.report({"INFO"}, f"'{target.name}' is the mesh of the take, {made}; run Reference to see it")
        return {"FINISHED"}


class REFMESH_OT_forget_own_mesh(SequenceOperator, bpy.types.Operator):
    """Go back to reconstructed reference meshes; the mesh of your own stays in the scene"""

    bl_idname = "refmesh.forget_own_mesh"
    bl_label = "Use Reconstructed Meshes"
    bl_options = {"UNDO"}

    @classmethod
    def poll_failure(cls, context):
        failure = super().poll_failure(context)
        return failure or ("" if sequence_object(context).refmesh.settings.mesh else "there is no mesh of your own in use")

    @reporting
    def execute(self, context):
        settings = sequence_object(context).refmesh.settings
        settings.property_unset("mesh")
        settings.property_unset("mesh_frame")
        return {"FINISHED"}


CLASSES = (REFMESH_OT_use_own_mesh, REFMESH_OT_forget_own_mesh)
