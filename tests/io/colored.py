"""Small colored files: a square of two triangles over a picture whose four corners have colors of their own."""

import io
from pathlib import Path

import numpy as np
from PIL import Image

RED, GREEN, BLUE, YELLOW = (255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 0)
CORNERS = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])  # of the square, counter-clockwise from the lower left
COLORS = (RED, GREEN, BLUE, YELLOW)  # of these corners
OBJ = "mtllib {library}\n" + "".join(f"v {x} {y} 0\nvt {x} {y}\n" for x, y in CORNERS) + "usemtl skin\nf 1/1 2/2 3/3 4/4\n"


def picture(size: int = 8) -> np.ndarray:
    """(size, size, 3), the quarters in COLORS; the first row is at the top, so v = 1."""
    half = np.zeros((2, 2, 3), np.uint8)
    half[1, 0], half[1, 1], half[0, 1], half[0, 0] = COLORS
    return half.repeat(size // 2, axis=0).repeat(size // 2, axis=1)


def encoded(pixels: np.ndarray, kind: str = "PNG") -> bytes:
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, kind)
    return file.getvalue()


def write_obj(folder: Path, stem: str = "scan_0001", mtl: str = "newmtl skin\nmap_Kd skin.png\n", library: str = "scan.mtl") -> Path:
    """An OBJ, its library and its picture in a folder."""
    (folder / "scan.mtl").write_text(mtl)
    (folder / "skin.png").write_bytes(encoded(picture()))
    path = folder / f"{stem}.obj"
    path.write_text(OBJ.format(library=library))
    return path


def colors_near_corners(appearance) -> list[tuple[int, ...]]:
    """The color a fifth of the way from each corner of the square to its middle."""
    result = []
    for corner in CORNERS:
        point = np.append(corner + 0.2 * (0.5 - corner), 0.0)
        for index, triangle in enumerate(appearance.mesh.triangles):
            a, b, c = appearance.mesh.vertices[triangle]
            shares = np.linalg.lstsq(np.stack([b - a, c - a], axis=1), point - a, rcond=None)[0]
            if shares.min() > -1e-9 and shares.sum() < 1 + 1e-9:
                color = appearance.at(np.array([index]), shares[None].astype(np.float32))[0]
                result.append(tuple(int(round(float(value))) for value in color))
                break
    return result
