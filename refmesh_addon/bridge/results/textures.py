"""The capture's colors on the results: the texture layout as UVs, the image sequence and the steady textures as materials."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...io.result_arrays import read_layout
from ..scene.geometry_update import OWN_MESH
from ..scene.materials import fade_by, image_material
from ..scene.meshes import OWN_LAYOUT, has_layout, set_uvs
from ..scene.paths import stored_path
from ..scene.timeline import TEXTURE_MARK
from ..scene.visibility_nodes import TRANSPARENCY
from .groups import deformed_material


def show_textures(owner: bpy.types.Object, folder: Path, report: dict) -> None:
    """Gives all groups their UVs and prepares their materials; without textures, groups keep neither."""
    numbers = {frame["number"]: frame.get("texture") for frame in report["frames"]}
    textured = all(group.get("layout") for group in report["groups"]) and all(numbers.values()) and bool(numbers)
    for group, entry in zip(owner.refmesh.groups, report["groups"]):
        for member in (group.reference, group.deformed):
            if member is None or not textured:
                continue
            if OWN_MESH in member.data:
                member.data[OWN_LAYOUT] = entry.get("layout_source") == "own" and len(member.data.uv_layers) > 0
            else:
                uvs, triangles = read_layout(folder / entry["layout"], len(member.data.polygons))
                set_uvs(member.data, uvs[triangles])
    if not textured:
        show_surface_color(owner)
        return
    first = folder / report["frames"][0]["texture"]
    files = sorted(first.parent.glob(f"frame_*{first.suffix}"))
    captured = load_image(first, sequence=True)
    playing = image_material(captured_name(owner), captured, int(first.stem.rpartition("_")[2]), len(files))
    if any(group.get("visibility") for group in report["groups"]):
        fade_by(playing, TRANSPARENCY)  # not the steady ones, which files carry: viewers would blend the whole body
    for index, entry in enumerate(report["groups"]):
        image_material(steady_name(owner, index), load_image(folder / entry["texture"]))
        painted = latest_painted(folder / entry["texture"])
        if painted is not None:
            image_material(painted_name(owner, index), load_image(painted))
    show_surface_color(owner)


def show_surface_color(owner: bpy.types.Object) -> None:
    """Shows what `owner.refmesh.surface_color` says on the groups that wear a material of RefMesh; one of the user's own stays."""
    for index, group in enumerate(owner.refmesh.groups):
        if group.deformed is not None and wears_own_material(owner, group.deformed.data):
            group.deformed.data.materials[0] = _chosen_material(owner, index, group.deformed.data) or deformed_material()


def wears_own_material(owner: bpy.types.Object, mesh: bpy.types.Mesh) -> bool:
    """Whether the only material of a mesh is one that RefMesh gave it."""
    names = (name(owner, index) for name in (steady_name, painted_name) for index in range(len(owner.refmesh.groups)))
    own = {captured_name(owner), deformed_material().name, *names}
    return len(mesh.materials) == 1 and mesh.materials[0] is not None and mesh.materials[0].name in own


def _chosen_material(owner: bpy.types.Object, index: int, mesh: bpy.types.Mesh) -> bpy.types.Material | None:
    """None for the plain color, and where there are no textures."""
    choice = owner.refmesh.surface_color
    if not has_layout(mesh) or choice == "PLAIN":
        return None
    painted = bpy.data.materials.get(painted_name(owner, index)) if choice == "PAINTED" else None
    return painted or bpy.data.materials.get(captured_name(owner) if choice == "CAPTURED" else steady_name(owner, index))


def captured_name(owner: bpy.types.Object) -> str:
    """Name of the material that plays the capture's colors."""
    return f"{owner.refmesh.root.name} Captured"


def steady_name(owner: bpy.types.Object, index: int) -> str:
    """Name of the material with the steady texture of a group."""
    return f"{owner.refmesh.root.name} Steady {index:03d}"


def painted_name(owner: bpy.types.Object, index: int) -> str:
    """Name of the material with what the user has painted on the steady texture of a group."""
    return f"{owner.refmesh.root.name} Painted {index:03d}"


def latest_painted(steady: Path) -> Path | None:
    """The painted texture that was put aside last when a run wrote a steady texture anew; None where there is none."""
    stem = f"{steady.stem}_painted_"
    numbers = [path.stem.removeprefix(stem) for path in steady.parent.glob(f"{stem}*.png")]
    known = [int(number) for number in numbers if number.isdecimal()]
    return steady.with_name(f"{stem}{max(known)}.png") if known else None


def load_image(path: Path, sequence: bool = False) -> bpy.types.Image:
    """The image of a file, read anew where it is there already, by a relative path where the scene has a place."""
    image = bpy.data.images.load(str(path), check_existing=True)
    image.source = "SEQUENCE" if sequence else "FILE"
    image.reload()
    image.filepath = stored_path(path)
    image[TEXTURE_MARK] = True
    return image
