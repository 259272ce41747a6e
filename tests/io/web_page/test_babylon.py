"""Small GLB files in Babylon.js, in a real browser."""

import base64

import numpy as np
import pytest

from refmesh_addon.io.small_glb.choice import SmallGlb
from refmesh_addon.io.small_glb.writer import encoded
from tests.io.refmesh_stream.bodies import torus_groups
from tests.io.small_glb.programs import node_package
from tests.io.small_glb.test_surface import painted
from tests.io.small_glb.unpacking import Glb
from tests.io.web_page.browser import started_browser

DIAGONAL, RATE = 4.0, 30.0
FRAMES_A_SECOND = 60  # in which Babylon.js counts the times of glTF
PAGE = """<!DOCTYPE html><canvas id="canvas" width="320" height="240"></canvas>
<script src="{babylon}"></script><script src="{loaders}"></script>
<script>
BABYLON.MeshoptCompression.Configuration = {{ decoder: {{ url: "{decoder}" }} }};
const scene = new BABYLON.Scene(new BABYLON.Engine(document.getElementById("canvas")));
scene.useRightHandedSystem = true;
BABYLON.SceneLoader.AppendAsync("", "data:;base64,{data}", scene, null, ".glb").then(() => {{
  scene.createDefaultCameraOrLight(true, true, true);
  scene.animationGroups.forEach((group) => group.stop());
  window.loaded = true;
}}, (error) => {{ window.failed = String(error); }});
function positions(seconds) {{
  for (const group of scene.animationGroups) {{ group.play(); group.goToFrame(seconds * {frames}); group.pause(); }}
  scene.render();
  const result = [];
  for (const mesh of scene.meshes) {{
    if (!mesh.getTotalVertices() || Math.abs(mesh.parent.scaling.x) < 0.5) continue;
    const matrix = mesh.computeWorldMatrix(true), data = mesh.getPositionData(false, true);
    for (let index = 0; index < data.length; index += 3) {{
      result.push(...BABYLON.Vector3.TransformCoordinates(BABYLON.Vector3.FromArray(data, index), matrix).asArray());
    }}
  }}
  return result;
}}
</script>"""


@pytest.mark.parametrize("packed", [False, True], ids=["plain", "packed"])
def test_every_frame_has_the_positions_of_the_file(tmp_path, packed):
    scripts = {
        "babylon": node_package("babylonjs") / "babylon.js",
        "loaders": node_package("babylonjs-loaders") / "babylonjs.loaders.min.js",
        "decoder": node_package("meshoptimizer") / "meshopt_decoder.cjs",
    }
    groups = [painted(group) for group in torus_groups()]
    data, _ = encoded(groups, DIAGONAL, RATE, SmallGlb(error=2e-3, triangles=(2000,), texture=64, packed=packed))
    uris = {name: path.as_uri() for name, path in scripts.items()}
    page = PAGE.format(data=base64.b64encode(data).decode(), frames=FRAMES_A_SECOND, **uris)
    (tmp_path / "babylon.html").write_text(page)
    glb = Glb(data)
    with started_browser() as browser:
        browser.open((tmp_path / "babylon.html").as_uri())
        browser.wait("window.loaded || window.failed")
        assert browser.run("return window.failed || ''") == ""
        for number in (4, 5, 6, 8, 9):
            shown = browser.run("return positions(arguments[0])", (number - 4) / RATE)
            np.testing.assert_allclose(np.reshape(shown, (-1, 3)), glb.at((number - 4) / RATE)[0], atol=1e-5)
