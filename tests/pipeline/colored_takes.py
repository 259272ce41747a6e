"""Small colored takes on disk: a painted ball that moves, meshed and laid out anew on every frame."""

from pathlib import Path

import numpy as np

from refmesh_addon.core.color.exposure import exposed
from refmesh_addon.core.geometry.vectors import normalized
from refmesh_addon.io.images import write_image
from tests.core.color.painted import cube_sphere, painted, smooth_color

NUMBERS = (3, 4, 5, 6)
GAINS = (1.0, 1.1, 0.9, 1.2)
STEP = np.array([0.1, 0.05, 0.0])  # the ball goes this far from frame to frame
SIZE = 128


def write_textured(folder: Path, gains=GAINS) -> Path:
    """OBJ, MTL and PNG for each of NUMBERS."""
    folder.mkdir(exist_ok=True)
    for index, (number, gain) in enumerate(zip(NUMBERS, gains)):
        mesh, layout = cube_sphere(7 + index, turn=0.3 * index)
        image = painted(mesh, layout, SIZE, material).images[0]
        write_image(folder / f"ball_{number:03d}.png", exposed(image.reshape(-1, 3), np.full(3, gain)).reshape(image.shape))
        (folder / f"ball_{number:03d}.mtl").write_text(f"newmtl skin\nmap_Kd ball_{number:03d}.png\n")
        rows = [f"mtllib ball_{number:03d}.mtl", "usemtl skin"]
        rows += [f"v {x} {y} {z}" for x, y, z in mesh.vertices + STEP * index]
        rows += [f"vt {u} {v}" for u, v in layout.uvs]
        rows += [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in layout.triangles + 1]
        (folder / f"ball_{number:03d}.obj").write_text("\n".join(rows) + "\n")
    return folder


def write_vertex_colored(folder: Path) -> Path:
    """OBJ with vertex colors for each of NUMBERS."""
    folder.mkdir(exist_ok=True)
    for index, number in enumerate(NUMBERS):
        mesh, _ = cube_sphere(7 + index, turn=0.3 * index)
        colors = material(mesh.vertices) / 255
        rows = [f"v {x} {y} {z} {r} {g} {b}" for (x, y, z), (r, g, b) in zip(mesh.vertices + STEP * index, colors)]
        rows += [f"f {a} {b} {c}" for a, b, c in mesh.triangles + 1]
        (folder / f"ball_{number:03d}.obj").write_text("\n".join(rows) + "\n")
    return folder


def material(points: np.ndarray) -> np.ndarray:
    """Color of the ball by direction from its middle, between black and white so that exposures do not clip."""
    return (0.75 * smooth_color(normalized(points)) + 20).astype(np.uint8)
