"""Write the frames of this sample: python -m sample_scenes.grasp.generate (from the repository's folder), or `make samples`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from refmesh_addon.core.types import TriangleMesh

from ..generators import SEQUENCES

FOLDER = Path(__file__).parent / "frames"
FRAMES = 12
FIRST_NUMBER = 40  # captures rarely start at 0
FIRST_SEED = 12  # these grids leave no specks where hand and ball meet at a narrow angle
DECIMALS = 3  # of a millimetre


def frames() -> Iterator[tuple[str, str]]:
    """File name and text of each frame."""
    for number, mesh in enumerate(SEQUENCES["grasp"]().frames(FRAMES, FIRST_SEED), FIRST_NUMBER):
        yield f"grasp_{number:04d}.obj", obj_text(mesh)


def obj_text(mesh: TriangleMesh) -> str:
    """The mesh as Wavefront OBJ."""
    vertices = np.round(mesh.vertices, DECIMALS) + 0.0  # -0.0 becomes 0.0
    lines = [f"v {x:.{DECIMALS}f} {y:.{DECIMALS}f} {z:.{DECIMALS}f}" for x, y, z in vertices]
    lines += [f"f {a} {b} {c}" for a, b, c in mesh.triangles + 1]
    return "\n".join(lines) + "\n"


def main() -> None:
    FOLDER.mkdir(exist_ok=True)
    for name, text in frames():
        (FOLDER / name).write_text(text)


if __name__ == "__main__":
    main()
