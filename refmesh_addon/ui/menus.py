"""Entries in Blender's menus."""

import bpy


def draw_import(self, context):
    self.layout.operator("refmesh.import_sequence", text="Mesh Sequence (RefMesh)")
    self.layout.operator("refmesh.import_stream", text="RefMesh Stream (.refmesh)")


def register():
    bpy.types.TOPBAR_MT_file_import.append(draw_import)


def unregister():
    bpy.types.TOPBAR_MT_file_import.remove(draw_import)
