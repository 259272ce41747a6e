"""Make the pictures of the documentation from the sample: `make pictures`.

The sample is run with the standard settings, in build/pictures; a run that is there is taken up. Every frame is then drawn as
four actors on one line: the input, the centers, the reference mesh of the frame's group, and the deformed mesh. The map of
rooms is drawn as well, and the preview of `make demo` is made smaller.
"""

from __future__ import annotations

import subprocess
import sys
from math import pi
from pathlib import Path

import bpy
import numpy as np
import rooms
from mathutils import Matrix
from PIL import Image
from trimesh.creation import icosphere

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from refmesh_addon.bridge.picture.preview import VIEW  # noqa: E402
from refmesh_addon.bridge.picture.studio import add, render, studio, write  # noqa: E402
from refmesh_addon.bridge.results.center_colors import colors_by_place  # noqa: E402
from refmesh_addon.bridge.results.centers import RADIUS_SHARE, spacing  # noqa: E402
from refmesh_addon.bridge.scene.materials import REFERENCE_COLOR, SOURCE_COLOR, attribute_material, plain_material  # noqa: E402
from refmesh_addon.bridge.scene.meshes import COLOR_NAME, fill_mesh, set_colors  # noqa: E402
from refmesh_addon.core.types import TriangleMesh  # noqa: E402
from refmesh_addon.io.meshes import read_mesh  # noqa: E402
from refmesh_addon.io.report import read_report  # noqa: E402

SAMPLE = ROOT / "sample_scenes" / "grasp" / "frames"
PICTURES = ROOT / "docs" / "pictures"
WORK = ROOT / "build" / "pictures"
DEMO = ROOT / "build" / "demo" / "preview.png"
RESULT_COLOR = (0.10, 0.32, 0.60, 1.0)
TITLES = (
    "input: a different mesh in every frame",
    "centers in its volume",
    "reference mesh: hand and ball apart",
    "result: one mesh that moves",
)
WIDTH = 1200  # pixels
SHOWN = 150  # milliseconds for one frame of the animation
QUALITY = 80  # of the pictures' compression
GAP = 0.12  # between actors, as a share of the widest
LINE = 0.016  # height of the titles, as a share of the width
LINES = 0.6  # pixels: thickness of the drawn edges


def main() -> None:
    """Runs the sample and writes the pictures."""
    rooms.main()
    out = WORK / "out"
    subprocess.run([sys.executable, str(ROOT / "headless" / "run.py"), str(SAMPLE), "--output", str(out), "--quiet"], check=True)
    report = read_report(out)
    rows = [actors(out, report, frame, index) for index, frame in enumerate(report["frames"])]
    columns = [[row[column][0].vertices for row in rows] for column in range(len(TITLES))]
    boxes = [(np.min([v.min(axis=0) for v in column], axis=0), np.max([v.max(axis=0) for v in column], axis=0)) for column in columns]
    pictures = [draw(row, boxes, WORK / f"frame_{frame['number']}.png") for row, frame in zip(rows, report["frames"])]
    write_pictures([Image.open(picture).convert("RGB") for picture in pictures])
    write_demo()


def write_pictures(frames: list[Image.Image]) -> None:
    """The animation of all frames, and the frame in its middle, in which hand and ball share one surface."""
    PICTURES.mkdir(exist_ok=True)
    frames[0].save(PICTURES / "sample.webp", save_all=True, append_images=frames[1:], duration=SHOWN, loop=0, quality=QUALITY, method=6)
    frames[len(frames) // 2].save(PICTURES / "sample.jpg", quality=QUALITY, optimize=True)
    for picture in sorted(PICTURES.glob("sample.*")):
        print(f"{picture.relative_to(ROOT)}  {picture.stat().st_size / 1000:.0f} kB")


def write_demo() -> None:
    """The textured sample as `make demo` shows it: source, reference mesh, and the result by its error and in its colors."""
    preview = Image.open(DEMO).convert("RGB")
    size = WIDTH, round(WIDTH * preview.height / preview.width)
    preview.resize(size, Image.Resampling.LANCZOS).save(PICTURES / "demo.jpg", quality=QUALITY, optimize=True)


def actors(out: Path, report: dict, frame: dict, index: int) -> list[tuple]:
    """(mesh, colors or None, material's name and color) of the four actors of a frame, turned to the camera."""
    with np.load(out / "centers.npz") as arrays:
        first, centers = arrays["positions"][0], arrays["positions"][index]
    group = next(group for group in report["groups"] if frame["number"] in group["frames"])
    file = report["sequence"]["files"][index]
    return [
        (turned(read_mesh(SAMPLE / file)), None, ("input", SOURCE_COLOR)),
        (turned(balls(centers, RADIUS_SHARE * spacing(first))), colors_by_place(first), ("centers", None)),
        (turned(read_mesh(out / group["reference"])), None, ("reference", REFERENCE_COLOR)),
        (turned(read_mesh(out / frame["deformed"])), None, ("result", RESULT_COLOR)),
    ]


def turned(mesh: TriangleMesh) -> TriangleMesh:
    """The mesh, Y up in its file, as the camera of the preview sees it."""
    turn = VIEW.to_matrix().transposed() @ Matrix.Rotation(pi / 2, 3, "X")
    return mesh.moved(mesh.vertices @ np.array(turn).T)


def balls(centers: np.ndarray, radius: float) -> TriangleMesh:
    """One mesh of a small ball around each of the (C, 3) centers."""
    ball = icosphere(subdivisions=2, radius=radius)
    vertices = (centers[:, None] + ball.vertices).reshape(-1, 3)
    return TriangleMesh(vertices, (ball.faces + len(ball.vertices) * np.arange(len(centers))[:, None, None]).reshape(-1, 3))


def draw(row: list[tuple], boxes: list[tuple[np.ndarray, np.ndarray]], target: Path) -> Path:
    """Renders the actors of a frame, each in the middle of its column."""
    sizes = np.array([high - low for low, high in boxes])
    column, (_, height, depth) = (1 + GAP) * sizes[:, 0].max(), sizes.max(axis=0)
    line = LINE * column * len(row)
    with studio() as scene:
        for place, ((mesh, colors, material), (low, high), title) in enumerate(zip(row, boxes, TITLES)):
            middle = np.array([place * column, height / 2, 0.0]) - (low + high) / 2
            show(scene, mesh.moved(mesh.vertices + middle), colors, material)
            write(scene, title, (place * column, -line), line)
        left, right = -column / 2, (len(row) - 0.5) * column
        render(scene, np.array([left, -3 * line, -depth]), np.array([right, height + line, depth]), target, WIDTH)
    return target


def show(scene: bpy.types.Scene, mesh: TriangleMesh, colors: np.ndarray | None, material: tuple) -> None:
    """Adds a mesh in one color, with its edges drawn, or in a color for each of its equal parts."""
    data = bpy.data.meshes.new(material[0])
    fill_mesh(data, mesh)
    if colors is None:
        data.materials.append(with_edges(plain_material(*material)))
    else:
        set_colors(data, np.repeat(colors, len(mesh.vertices) // len(colors), axis=0))
        data.materials.append(attribute_material(material[0], COLOR_NAME))
    data.shade_smooth()
    add(scene, material[0], data)


def with_edges(material: bpy.types.Material) -> bpy.types.Material:
    """The material with the edges of the triangles drawn, darker than it."""
    tree = material.node_tree
    surface = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    color = surface.inputs["Base Color"]
    if not color.links:
        edges, mix = tree.nodes.new("ShaderNodeWireframe"), tree.nodes.new("ShaderNodeMixRGB")
        edges.use_pixel_size, edges.inputs["Size"].default_value = True, LINES
        mix.inputs[1].default_value = color.default_value
        mix.inputs[2].default_value = [0.35 * value for value in color.default_value[:3]] + [1.0]
        tree.links.new(edges.outputs["Fac"], mix.inputs["Fac"])
        tree.links.new(mix.outputs["Color"], color)
    return material


if __name__ == "__main__":
    main()
