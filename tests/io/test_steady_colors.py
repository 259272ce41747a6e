import numpy as np
import pytest

from refmesh_addon.core.color.projected_layout import projected_layout
from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.io.files import write_npz
from refmesh_addon.io.images import write_image
from refmesh_addon.io.ply import write_ply
from refmesh_addon.io.steady_colors import steady_colors
from tests.core import shapes

MESH = shapes.ball(2)
TEXTURED = {"groups": [{"index": 0, "texture": "steady.png", "layout": "layout.npz"}], "frames": []}


def write_texture(folder, gray=90):
    layout = projected_layout(MESH)
    write_npz(folder / "layout.npz", {"uvs": layout.uvs, "triangles": layout.triangles})
    write_image(folder / "steady.png", np.full((16, 16, 3), gray, np.uint8))
    return layout


def test_a_texture_comes_with_its_layout(tmp_path):
    layout = write_texture(tmp_path)
    appearance = steady_colors(tmp_path, TEXTURED, 0, MESH)
    np.testing.assert_allclose(appearance.uvs, layout.corners, atol=1e-6)
    assert (appearance.images[0] == 90).all() and appearance.mesh is MESH


def test_colors_of_vertices_are_the_median_of_the_frames(tmp_path):
    frames = []
    for number, gray in enumerate((10, 200, 60)):
        name = f"frame_{number:04d}.ply"
        write_ply(tmp_path / name, MESH, np.tile(np.array([[gray, gray, gray, 255]], np.uint8), (len(MESH.vertices), 1)))
        frames.append({"number": number, "group": 0, "colored": name})
    appearance = steady_colors(tmp_path, {"groups": [{"index": 0}], "frames": frames}, 0, MESH)
    assert (appearance.colors == 60).all() and not appearance.images


def test_results_without_colors_have_none(tmp_path):
    assert steady_colors(tmp_path, {"groups": [{"index": 0}], "frames": [{"number": 1, "group": 0}]}, 0, MESH) is None


def test_files_that_are_missing_or_of_another_mesh_are_refused_by_name(tmp_path):
    with pytest.raises(RefMeshError, match="layout.npz: cannot be read .* run the Color step again"):
        steady_colors(tmp_path, TEXTURED, 0, MESH)
    write_texture(tmp_path)
    with pytest.raises(RefMeshError, match="layout.npz: is the layout of another mesh"):
        steady_colors(tmp_path, TEXTURED, 0, shapes.torus())
    (tmp_path / "steady.png").unlink()
    with pytest.raises(RefMeshError, match="steady.png: cannot be read"):
        steady_colors(tmp_path, TEXTURED, 0, MESH)
