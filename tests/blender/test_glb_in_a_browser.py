"""The full GLB in three.js, in a real browser: each pixel has the color of the steady texture at its place on the layout."""

from __future__ import annotations

import base64
import io

import bpy
import numpy as np
import pytest
from PIL import Image

from refmesh_addon.core.color.raster import rasterized
from refmesh_addon.io.images import write_image
from refmesh_addon.io.ply import read_surface
from refmesh_addon.io.result_arrays import read_layout
from refmesh_addon.io.small_glb.choice import WrittenRun
from refmesh_addon.io.web_page.writer import Take, viewer_problem, write_web_page
from tests.io.web_page.browser import started_browser

from .test_textures import colored, exported  # noqa: F401  (a fixture)

SIZE = 64  # pixels of the texture
GRAY_LEVELS = 6.0  # of rounding and filtering, and of the light that three.js gives to reflections: 2
LEAST_SHARE = 0.9  # of the pixels that have their color: along the borders of charts and the outline, pixels mix two
COVERED = 5000  # pixels that the body covers at the least
# Light that is the same from everywhere and makes a white surface white, so that the picture has the colors of the texture.
EVEN_LIGHT = """
const viewer = refmesh.viewer;
viewer.scene.traverse((item) => {
  if (item.isDirectionalLight) item.intensity = 0;
  if (item.isHemisphereLight) { item.groundColor.copy(item.color); item.intensity = Math.PI; }
});
viewer.frameTake();
viewer.camera.updateMatrixWorld(true);
viewer.render();
return [viewer.renderer.domElement.toDataURL('image/png'), viewer.camera.projectionMatrix.elements,
        viewer.camera.matrixWorldInverse.elements];
"""


def shades(uvs: np.ndarray) -> np.ndarray:
    """(N, 3) colors of a texture at (N, 2) places on it: red grows to the right, green upward."""
    return np.column_stack([40 + 170 * uvs, np.full(len(uvs), 120.0)])


def paint(path) -> None:
    middle = (np.arange(SIZE) + 0.5) / SIZE
    right, up = np.meshgrid(middle, 1 - middle)
    write_image(path, np.rint(shades(np.column_stack([right.ravel(), up.ravel()]))).astype(np.uint8).reshape(SIZE, SIZE, 3))


def shown_in_three_js(path, folder) -> tuple[np.ndarray, np.ndarray]:
    """(H, W, 3) picture of the first frame, and (4, 4) from the places of the file to those of the picture, -1 to 1."""
    write_web_page(folder, "ball", Take("ball", path.read_bytes(), [WrittenRun((6,), 0.0, 1, 1)], 24.0))
    with started_browser() as browser:
        browser.open((folder / "index.html").as_uri() + "?paused")
        browser.wait("window.refmesh && (window.refmesh.ready || window.refmesh.error)")
        assert browser.run("return refmesh.error || ''") == ""
        url, projection, view = browser.run(EVEN_LIGHT)
    picture = Image.open(io.BytesIO(base64.b64decode(url.partition(",")[2]))).convert("RGB")
    return np.array(picture, float), np.reshape(projection, (4, 4)).T @ np.reshape(view, (4, 4)).T


def expected_colors(positions, triangles, uvs, matrix, shape) -> tuple[np.ndarray, np.ndarray]:
    """(N,) pixels that a convex body covers, and (N, 3) their colors.  uvs : (T, 3, 2)."""
    height, width = shape
    clip = np.column_stack([positions, np.ones(len(positions))]) @ matrix.T
    corners = ((clip[:, :2] / clip[:, 3:] * [0.5, -0.5] + 0.5) * [width, height])[triangles]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    in_front = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0] < 0  # y grows downward
    covered = rasterized(corners[in_front], width, height)
    second_share, third_share = covered.shares.T[..., None].astype(float)  # perspective within a triangle is left out: below a gray level
    own = uvs[in_front][covered.triangles]
    return covered.pixels, shades((1 - second_share - third_share) * own[:, 0] + second_share * own[:, 1] + third_share * own[:, 2])


@pytest.mark.skipif(bool(viewer_problem()), reason=viewer_problem() or "-")
def test_pixels_have_the_colors_of_the_steady_texture(colored, results, tmp_path):  # noqa: F811
    for index in range(2):
        paint(results / "texture" / f"group_{index:03d}_steady.png")
    bpy.ops.refmesh.load_results(output=str(results))
    picture, matrix = shown_in_three_js(exported(colored, "glb"), tmp_path / "page")
    body = read_surface(results / "deformed" / "frame_0006.ply")
    uvs, triangles = read_layout(results / "texture" / "group_000_layout.npz", len(body.triangles))
    pixels, colors = expected_colors(body.vertices, body.triangles, uvs[triangles], matrix, picture.shape[:2])
    difference = np.abs(picture.reshape(-1, 3)[pixels] - colors).max(axis=1)
    assert len(pixels) > COVERED and np.ptp(colors[:, :2], axis=0).min() > 100
    assert np.mean(difference < GRAY_LEVELS) > LEAST_SHARE
