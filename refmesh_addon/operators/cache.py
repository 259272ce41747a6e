"""Removes what earlier runs have left for later ones."""

import bpy
from bpy.props import StringProperty

from ..properties.selection import sequence_object
from .common import SequenceOperator, chosen_output, reporting


class REFMESH_OT_clean_cache(SequenceOperator, bpy.types.Operator):
    """Remove the intermediate results in the output folder. Results and preview stay; the next run computes everything again"""

    bl_idname = "refmesh.clean_cache"
    bl_label = "Clean Cache"
    changes_sequence = False

    output: StringProperty(
        name="Output", description="Folder with the results; empty takes that of the panel", subtype="DIR_PATH", options={"SKIP_SAVE"}
    )

    @reporting
    def execute(self, context):
        from ..pipeline.process.lock import output_lock
        from ..pipeline.session.cache_size import clean_cache
        from ..pipeline.session.job import CACHE_FOLDER

        output = chosen_output(self.output or sequence_object(context).refmesh.output)
        with output_lock(output / CACHE_FOLDER, output):
            freed = clean_cache(output)
        self.report({"INFO"}, f"{freed / 1e6:.1f} MB of intermediate results removed")
        return {"FINISHED"}


CLASSES = (REFMESH_OT_clean_cache,)
