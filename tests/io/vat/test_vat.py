import json

import numpy as np
import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.geometry.mesh import vertex_normals
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.refmesh_stream.writer import FrameGroup
from refmesh_addon.io.vat.arrangement import LARGEST, Arrangement
from refmesh_addon.io.vat.png import encoded_png
from refmesh_addon.io.vat.writer import VatChoice, write_vat
from tests.core import shapes
from tests.io.refmesh_stream.bodies import torus_groups, waving
from tests.io.small_glb.programs import VALIDATE, node
from tests.io.small_glb.test_surface import painted
from tests.io.small_glb.unpacking import Glb
from tests.io.vat.bodies import read_png, shown

RATE = 30.0
PLACEMENT = np.array([[0.0, 0, 1, 5], [1, 0, 0, 6], [0, 1, 0, 7], [0, 0, 0, 1]])


def written(folder, group, choice):
    result = write_vat(folder / "torus_vat", "torus", group, RATE, choice)
    files = {path.name: path.read_bytes() for path in result.paths}
    remap = json.loads(files["torus-remap_info.json"])
    normals = read_png(files["torus_vnrm.png"]) if "torus_vnrm.png" in files else None
    return result, Glb(files["torus.glb"]), read_png(files["torus_vat.png"]), normals, remap


@pytest.mark.parametrize("arrangement", ["square", "row"])
@pytest.mark.parametrize("color", [lambda group: group, painted], ids=["plain", "textured"])
def test_a_shader_of_the_convention_shows_every_frame(tmp_path, arrangement, color):
    group = color(torus_groups()[0])
    result, glb, picture, normals, remap = written(tmp_path, group, VatChoice(arrangement, placement=PLACEMENT))
    assert (normals is None) == (arrangement == "row")
    for frame, positions in enumerate(group.positions):
        x, y, z = (positions @ PLACEMENT[:3, :3].T + PLACEMENT[:3, 3]).T
        right = TriangleMesh(np.column_stack([x, z, -y]), group.triangles)
        vertices, directions = shown(glb, picture, normals, remap, frame)
        distances = np.linalg.norm(right.vertices[:, None] - vertices, axis=2)
        nearest = distances.argmin(axis=0)
        assert distances.min(axis=0).max() <= result.largest + 1e-6
        assert (np.einsum("ij,ij->i", vertex_normals(right)[nearest], directions) > 1.0 - 1e-4).all()
    assert remap["os-remap"]["Frames"] == 3 and remap["animations"]["torus"]["framerate"] == RATE


def test_the_cost_of_16_bits_is_half_a_step_at_most(tmp_path):
    result, *_, remap = written(tmp_path, torus_groups()[0], VatChoice())
    steps = (np.array(remap["os-remap"]["Max"]) - remap["os-remap"]["Min"]) / 65535
    assert 0.0 < result.rms < result.largest <= 0.5 * np.linalg.norm(steps) * (1 + 1e-9)
    assert 0.0 < result.degrees < 0.01


def test_missing_frames_hold_the_one_before(tmp_path):
    mesh = shapes.torus()
    group = FrameGroup((4, 7, 8), waving(mesh, 3), mesh.triangles)
    _, glb, picture, normals, remap = written(tmp_path, group, VatChoice())
    frames = [shown(glb, picture, normals, remap, frame)[0] for frame in range(5)]
    assert remap["os-remap"]["Frames"] == 5
    np.testing.assert_array_equal(frames[2], frames[0])
    assert (frames[3] != frames[2]).any()


def test_fewer_triangles_stay_close(tmp_path):
    group = torus_groups()[0]
    _, glb, picture, normals, remap = written(tmp_path, group, VatChoice(triangles=400))
    vertices, _ = shown(glb, picture, normals, remap, 2)
    x, y, z = group.positions[2].T
    assert SurfaceIndex(TriangleMesh(np.column_stack([x, z, -y]), group.triangles)).query(vertices).distances.max() < 0.05
    assert len(glb.accessor(glb.json["meshes"][0]["primitives"][0]["indices"])) <= 3 * 400


@pytest.mark.parametrize(("vertices", "frames"), [(1, 1), (20_000, 60), (64, 4000), (8192, 500)])
def test_every_vertex_and_frame_has_a_texel_of_its_own(vertices, frames):
    arrangement = Arrangement.square(vertices, frames)
    assert max(arrangement.width, arrangement.height) <= LARGEST
    assert arrangement.width & (arrangement.width - 1) == arrangement.height & (arrangement.height - 1) == 0
    rows, columns = arrangement.texels()
    used = np.zeros((arrangement.height, arrangement.width), bool)
    used[rows, columns] = True
    assert used.sum() == vertices * frames


def test_what_engines_cannot_read_is_refused():
    with pytest.raises(RefMeshError, match="9000 vertices and 10 frames do not fit .* in a row each; reduce the triangles"):
        Arrangement.row(9000, 10)
    with pytest.raises(RefMeshError, match="do not fit into a texture of 8192 x 8192, reduce the triangles or choose fewer frames"):
        Arrangement.square(100_000, 1000)


@pytest.mark.parametrize("group", [torus_groups()[0], painted(torus_groups()[0])], ids=["plain", "textured"])
def test_the_khronos_validator_finds_nothing_wrong_with_the_mesh(tmp_path, group):
    paths = write_vat(tmp_path, "torus", group, RATE, VatChoice()).paths
    issues = json.loads(node(VALIDATE, next(path for path in paths if path.suffix == ".glb"), "gltf-validator"))
    assert issues["numErrors"] == issues["numWarnings"] == 0
    assert ("torus_basecolor.png" in {path.name for path in paths}) == (group.appearance is not None)


def test_pixels_of_another_kind_are_refused():
    with pytest.raises(ValueError, match=r"pixels must be \(H, W, 3\) uint16; got \(2, 2, 4\) uint16"):
        encoded_png(np.zeros((2, 2, 4), np.uint16))
