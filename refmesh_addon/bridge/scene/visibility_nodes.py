"""A Geometry Nodes modifier by which a deformed mesh knows which of its vertices a frame shows; it plays without the add-on.

It looks the visibility up in a picture that is packed in the file, stores it as the attribute `visibility`, 0 to 1, and hides what is
not shown. Toward what is hidden the surface fades: the attribute `transparency` says how much, and materials of the add-on follow it.
Where nothing is hidden, all that is not shown fades, with the same topology in all frames.
"""

from __future__ import annotations

from pathlib import Path

import bpy

from ...core.errors import RefMeshError
from ...io.visibility_sheet import WIDTH, rows_per_frame

NAME = "RefMesh Visibility"  # of the modifier
ATTRIBUTE, TRANSPARENCY = "visibility", "transparency"
HIDE, FADE, THRESHOLD = "Hide Unseen", "Fade", "Threshold"  # inputs of the modifier


def play_visibility(member: bpy.types.Object, picture: Path | None, first_scene_frame: int) -> None:
    """Adds or updates the modifier, after all others; removes it where there is no picture.

    picture : of the visibility in each scene frame from `first_scene_frame` on. What a person has set on the modifier stays.
    Raises RefMeshError, naming the file, when it is missing or damaged.
    """
    if picture is None:
        remove_visibility(member)
        return
    modifier = member.modifiers.get(NAME) or member.modifiers.new(NAME, "NODES")
    tree = modifier.node_group or _new_tree(f"{NAME}: {member.name}")
    if tree.get("picture") != picture.name or tree.get("first") != first_scene_frame:
        _build(tree, _packed(picture), first_scene_frame, len(member.data.vertices))
        tree["picture"], tree["first"] = picture.name, first_scene_frame
    if modifier.node_group is None:
        modifier.node_group = tree


def show_all(member: bpy.types.Object) -> None:
    """Switches hiding and fading off on this object, so that its topology is that of all frames; the attribute `visibility` stays."""
    modifier = member.modifiers.get(NAME)
    for item in modifier.node_group.interface.items_tree if modifier is not None else ():
        if item.name in (HIDE, FADE):
            modifier[item.identifier] = False


def remove_visibility(member: bpy.types.Object) -> None:
    """Removes the modifier, if there is one."""
    modifier = member.modifiers.get(NAME)
    if modifier is not None:
        member.modifiers.remove(modifier)


def _packed(picture: Path) -> bpy.types.Image:
    try:
        image = bpy.data.images.load(str(picture), check_existing=True)
    except RuntimeError as error:  # what Blender raises for a file that is not there
        raise RefMeshError(f"{picture}: cannot be read; run the Deform step again") from error
    image.colorspace_settings.name = "Non-Color"
    if image.size[0] != WIDTH:
        bpy.data.images.remove(image)
        raise RefMeshError(f"{picture}: is damaged; run the Deform step again")
    image.pack()
    return image


def _new_tree(name: str) -> bpy.types.GeometryNodeTree:
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    _add_switch(tree, HIDE, "Leave out what the frame does not show")
    threshold = tree.interface.new_socket(THRESHOLD, in_out="INPUT", socket_type="NodeSocketFloat")
    threshold.default_value, threshold.min_value, threshold.max_value = 0.5, 0.0, 1.0
    threshold.description = "Visibility below which a vertex counts as not shown"
    return tree


def _add_switch(tree: bpy.types.GeometryNodeTree, name: str, description: str) -> None:
    """An input that is on; one of this name stays."""
    if name not in tree.interface.items_tree:
        switch = tree.interface.new_socket(name, in_out="INPUT", socket_type="NodeSocketBool")
        switch.default_value, switch.description = True, description


def _build(tree: bpy.types.GeometryNodeTree, image: bpy.types.Image, first: int, vertices: int) -> None:
    """The nodes, in place of those of an earlier picture, which is removed where nothing else uses it."""
    old = {node.inputs["Image"].default_value for node in tree.nodes if node.bl_idname == "GeometryNodeImageTexture"} - {None, image}
    tree.nodes.clear()
    for other in old:
        if not other.users:
            bpy.data.images.remove(other)
    _add_switch(tree, FADE, "Materials of RefMesh become transparent toward what the frame does not show")
    nodes = _Nodes(tree)
    source, target = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    value = _looked_up(nodes, image, first, rows_per_frame(vertices))
    known = nodes.stored(source.outputs["Geometry"], ATTRIBUTE, value)
    hidden_below = nodes.math("MULTIPLY", source.outputs[THRESHOLD], source.outputs[HIDE])
    above = nodes.math("DIVIDE", nodes.math("SUBTRACT", value, hidden_below), nodes.math("SUBTRACT", 1.0, hidden_below))
    transparent = nodes.math("SUBTRACT", 1.0, nodes.math("MINIMUM", nodes.math("MAXIMUM", above, 0.0), 1.0))
    fade = nodes.add("GeometryNodeSwitch", input_type="GEOMETRY")
    nodes.link(source.outputs[FADE], fade.inputs["Switch"])
    nodes.link(known, fade.inputs["False"])
    nodes.link(nodes.stored(known, TRANSPARENCY, transparent), fade.inputs["True"])
    unseen = nodes.math("LESS_THAN", value, source.outputs[THRESHOLD])
    delete = nodes.add("GeometryNodeDeleteGeometry", domain="POINT")
    nodes.link(fade.outputs[0], delete.inputs["Geometry"])
    nodes.link(nodes.math("MULTIPLY", unseen, source.outputs[HIDE]), delete.inputs["Selection"])
    nodes.link(delete.outputs["Geometry"], target.inputs["Geometry"])


def _looked_up(nodes: _Nodes, image: bpy.types.Image, first: int, rows: int) -> bpy.types.NodeSocket:
    """The value of each vertex in the current scene frame; first and last frame are held."""
    width, height = image.size
    index = nodes.add("GeometryNodeInputIndex").outputs[0]
    frame = nodes.math("SUBTRACT", nodes.add("GeometryNodeInputSceneTime").outputs["Frame"], float(first))
    held = nodes.math("MINIMUM", nodes.math("MAXIMUM", nodes.math("FLOOR", frame), 0.0), float(height // rows - 1))
    row = nodes.math("FLOOR", nodes.math("DIVIDE", index, float(WIDTH)))
    column = nodes.math("SUBTRACT", index, nodes.math("MULTIPLY", row, float(WIDTH)))
    down = nodes.math("ADD", nodes.math("MULTIPLY", held, float(rows)), row)
    place = nodes.add("ShaderNodeCombineXYZ")
    nodes.link(nodes.math("DIVIDE", nodes.math("ADD", column, 0.5), float(width)), place.inputs["X"])
    from_top = nodes.math("DIVIDE", nodes.math("ADD", down, 0.5), float(height))
    nodes.link(nodes.math("SUBTRACT", 1.0, from_top), place.inputs["Y"])  # v runs upwards
    texture = nodes.add("GeometryNodeImageTexture", interpolation="Closest", extension="EXTEND")
    texture.inputs["Image"].default_value = image
    nodes.link(place.outputs[0], texture.inputs["Vector"])
    separate = nodes.add("FunctionNodeSeparateColor")
    nodes.link(texture.outputs["Color"], separate.inputs[0])
    return separate.outputs[0]


class _Nodes:
    """Adds nodes to a tree and links them."""

    def __init__(self, tree: bpy.types.GeometryNodeTree):
        self._tree = tree

    def add(self, kind: str, **settings: str) -> bpy.types.Node:
        node = self._tree.nodes.new(kind)
        for name, value in settings.items():
            setattr(node, name, value)
        return node

    def link(self, start: bpy.types.NodeSocket, end: bpy.types.NodeSocket) -> None:
        self._tree.links.new(start, end)

    def stored(self, geometry: bpy.types.NodeSocket, name: str, value: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
        """The geometry with a value for each point."""
        store = self.add("GeometryNodeStoreNamedAttribute", data_type="FLOAT", domain="POINT")
        store.inputs["Name"].default_value = name
        self.link(geometry, store.inputs["Geometry"])
        self.link(value, store.inputs["Value"])
        return store.outputs["Geometry"]

    def math(self, operation: str, *operands: bpy.types.NodeSocket | float) -> bpy.types.NodeSocket:
        """The result of a math node; numbers become its own values."""
        node = self.add("ShaderNodeMath", operation=operation)
        for socket, operand in zip(node.inputs, operands):
            if isinstance(operand, float):
                socket.default_value = operand
            else:
                self.link(operand, socket)
        return node.outputs[0]
