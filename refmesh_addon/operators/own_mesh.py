"""A mesh of the user's own in place of the reference mesh."""

import bpy
from bpy.props import IntProperty

from ..core.settings import OVER_REFERENCE
from ..properties.selection import sequence_object
from .common import SequenceOperator, chosen_output, reporting, wait_cursor


class OwnMeshOperator(SequenceOperator):
    """Makes a mesh the mesh of the take."""

    def use(self, context, owner, target, over):
        """Makes an object the mesh of the take.  over : what it was retopologized from."""
        from ..bridge.results.own_mesh import keep_own_mesh
        from ..bridge.sequence.raw_sequence import frame_at

        settings = owner.refmesh.settings
        settings.mesh = str(keep_own_mesh(owner, target, over.to_source, chosen_output(owner.refmesh.output)))
        settings.mesh_frame = OVER_REFERENCE if over.reference else int(frame_at(owner, context.scene.frame_current).name)
        made = "made over the reference mesh" if over.reference else f"made over frame {settings.mesh_frame}"
        self.report({"INFO"}, f"'{target.name}' is the mesh of the take, {made}; run Reference to see it")
        return {"FINISHED"}


class REFMESH_OT_use_own_mesh(OwnMeshOperator, bpy.types.Operator):
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
        from ..bridge.results.retopology_target import retopology_target

        owner, target = sequence_object(context), context.active_object
        chosen_output(owner.refmesh.output)
        context.view_layer.update()  # a script may have moved the object just before
        return self.use(context, owner, target, retopology_target(owner, target))


class REFMESH_OT_remesh_to_quads(OwnMeshOperator, bpy.types.Operator):
    """Copy the reference mesh of the take, remesh the copy with Blender's QuadriFlow and use it as the mesh of the take; 30,000 \
triangles take some 15 seconds"""

    bl_idname = "refmesh.remesh_to_quads"
    bl_label = "Remesh Reference to Quads"
    bl_options = {"REGISTER", "UNDO"}

    faces: IntProperty(
        name="Faces",
        description="About how many quads the mesh gets; 0 takes half as many as the reference mesh has triangles",
        default=0,
        min=0,
        soft_max=100_000,
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll_failure(cls, context):
        return super().poll_failure(context) or cls._reference_problem(sequence_object(context).refmesh.groups)

    @staticmethod
    def _reference_problem(groups):
        """Why there is no reference mesh that could be remeshed for the whole take, and what to do; "" where there is one."""
        if not groups or groups[0].reference is None:
            return "there is no reference mesh yet; run the Reference step first"
        if len(groups) > 1:
            several = f"the take has {len(groups)} reference meshes, and a mesh of your own serves the whole take"
            return f"{several}: give it one mesh first (One Mesh for, then Reference), or retopologize one frame"
        return ""

    @reporting
    def execute(self, context):
        from ..bridge.results.quads import remesh_to_quads
        from ..bridge.results.retopology_target import RetopologyTarget, results_to_source

        owner = sequence_object(context)
        chosen_output(owner.refmesh.output)
        context.view_layer.update()
        over = RetopologyTarget(results_to_source(owner), reference=True)
        with wait_cursor(context):
            quads = remesh_to_quads(context, owner, self.faces)
        return self.use(context, owner, quads, over)


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


CLASSES = (REFMESH_OT_use_own_mesh, REFMESH_OT_remesh_to_quads, REFMESH_OT_forget_own_mesh)
