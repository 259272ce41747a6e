import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.geometry.mesh import is_watertight, merged, signed_volume, triangle_areas
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.formats import FRAME_FORMATS
from refmesh_addon.io.meshes import parse_frame, parse_mesh, read_mesh

FORMATS = [known.name for known in FRAME_FORMATS.values()]
QUAD_PLY = """ply
format ascii 1.0
element vertex 6
property float x
property float y
property float z
element face 2
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
1 1 0
0 1 0
2 2 2
9 9 9
4 0 1 2 3
3 0 1 4
"""


@pytest.fixture
def ball():
    ball = trimesh.creation.icosphere(subdivisions=2)
    return TriangleMesh(1.5 * ball.vertices + [3, 4, 5], ball.faces)


def exported(mesh, kind, **options):
    data = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False).export(file_type=kind, **options)
    return data.encode() if isinstance(data, str) else data


@pytest.mark.parametrize("kind", FORMATS)
def test_every_format_gives_the_same_closed_surface(tmp_path, ball, kind):
    path = tmp_path / f"frame.{kind}"
    path.write_bytes(exported(ball, kind))
    mesh = read_mesh(path)
    assert len(mesh.triangles) == len(ball.triangles)
    assert is_watertight(mesh), "shared vertices are shared, in STL too"
    assert_allclose(signed_volume(mesh), signed_volume(ball), rtol=1e-5)


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("share", [0.0, 0.02, 0.3, 0.5, 0.8])
def test_cut_off_files_are_refused_by_name(ball, kind, share):
    data = exported(ball, kind)
    with pytest.raises(RefMeshError, match=rf"/frames/f_0007\.{kind}: ") as caught:
        parse_mesh(data[: int(share * len(data))], f"/frames/f_0007.{kind}")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("kind", FORMATS)
def test_other_files_under_a_mesh_name_are_refused(kind):
    for data in (b"a shopping list\nv for vegetables\nf for fruit\n" * 20, np.random.default_rng(3).bytes(3000)):
        with pytest.raises(RefMeshError, match=f"cannot be read as {kind.upper()}"):
            parse_mesh(data, f"list.{kind}")


@pytest.mark.parametrize("kind", FORMATS)
def test_damaged_bytes_give_a_mesh_or_a_refusal(ball, kind):
    data, rng = exported(ball, kind), np.random.default_rng(5)
    for _ in range(30):
        damaged = bytearray(data)
        for place in rng.integers(0, min(len(data), 600), 4):
            damaged[place] = rng.integers(256)
        try:
            mesh = parse_mesh(bytes(damaged), f"frame.{kind}")
        except RefMeshError as refusal:
            assert str(refusal).startswith(f"frame.{kind}: ")
        else:
            assert np.isfinite(mesh.vertices).all()
            assert mesh.triangles.min() >= 0
            assert mesh.triangles.max() < len(mesh.vertices)


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n", r"1 vertex has coordinates that are not finite numbers \(the first is vertex 3\)"),
        ("v 0 0 0\nv inf 0 0\nv 0 -inf 0\nf 1 2 3\n", "2 vertices have coordinates that are not finite"),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\n",
            r"1 triangle uses vertices that do not exist \(the first is triangle 2, of 3 vertices\)",
        ),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "do not exist"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\n", r"holds no triangles; is the file truncated\?"),
        ("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "zero area"),
        ("\n \n", "the file is empty"),
        ("", "the file is empty"),
    ],
)
def test_meshes_that_no_stage_could_use_are_refused_by_name(tmp_path, body, message):
    path = tmp_path / "scan_0012.obj"
    path.write_text(body)
    with pytest.raises(RefMeshError, match=message) as caught:
        read_mesh(path)
    assert str(caught.value).startswith(str(path))


def test_vertices_that_no_triangle_uses_need_not_be_finite():
    body = b"v nan 0 0\nv 0 0 0\nv 1 0 0\nv inf 2 2\nv 0 1 0\nv 5 5 5\nf 2 3 5\n"
    mesh = parse_mesh(body, "frame.obj")
    assert_array_equal(mesh.vertices, [[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]])
    assert_array_equal(mesh.triangles, [[0, 1, 2]])


def test_faces_left_out_are_counted():
    mesh, omitted = parse_frame(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\nf 1 2 3\n", "frame.obj")
    assert (len(mesh.triangles), omitted) == (1, 1)
    with pytest.raises(RefMeshError, match=r"holds no triangles; 1 face has fewer than three corners"):
        parse_mesh(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", "frame.obj")


def test_indices_out_of_range_are_refused_in_binary_files_too(ball):
    data = bytearray(exported(ball, "ply"))
    data[-4:] = (2**32 - 1).to_bytes(4, "little")
    with pytest.raises(RefMeshError, match="triangles? uses? vertices that do not exist"):
        parse_mesh(bytes(data), "frame.ply")


def test_a_folder_or_a_missing_file_is_refused(tmp_path):
    for path in (tmp_path, tmp_path / "gone.obj"):
        with pytest.raises(RefMeshError, match="cannot be read"):
            read_mesh(path)


def test_quads_are_triangulated_and_unused_vertices_stay():
    mesh = parse_mesh(QUAD_PLY.encode(), "quad.ply")
    assert len(mesh.vertices) == 6
    assert len(mesh.triangles) == 3
    assert_allclose(triangle_areas(mesh).sum(), 1 + np.sqrt(2), err_msg="the unit square and one triangle")


def test_parts_of_a_scene_come_in_their_places_and_right_side_out(ball):
    scene = trimesh.Scene()
    part = trimesh.Trimesh(ball.vertices, ball.triangles, process=False)
    scene.add_geometry(part, node_name="plain", geom_name="ball")
    mirror = np.diag([-1.0, 1.0, 1.0, 1.0])
    scene.add_geometry(part, node_name="mirrored", geom_name="ball", transform=mirror)
    scene.add_geometry(trimesh.PointCloud(np.zeros((3, 3))), node_name="dots")
    mesh = parse_mesh(scene.export(file_type="glb"), "pair.glb")
    assert len(mesh.triangles) == 2 * len(ball.triangles)
    assert_allclose(signed_volume(mesh), 2 * signed_volume(ball), rtol=1e-5)
    assert_allclose(mesh.vertices[:, 0].max(), -mesh.vertices[:, 0].min(), rtol=1e-6)


def test_vertices_along_a_seam_are_not_split():
    corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n"
    mesh = parse_mesh((corners + "f 1/1 2/2 3/3\nf 1/3 3/1 4/2\n").encode(), "uv.obj")
    assert_array_equal(mesh.triangles, [[0, 1, 2], [0, 2, 3]])
    assert len(mesh.vertices) == 4


def test_other_extensions_are_refused_with_the_list_of_those_that_are_read():
    with pytest.raises(RefMeshError, match=r"a\.fbx: '\.fbx' is not a mesh format that can be read; give one of \.obj, \.ply"):
        parse_mesh(b"Kaydara FBX Binary", "a.fbx")


@pytest.mark.parametrize("name", ["dancer/dancer_fr0006.obj", "collision/mesh_0016.obj"])
def test_captures_hold_the_triangles_that_trimesh_finds(shared_data, name):
    folder, _, file = name.partition("/")
    path = shared_data(folder) / file
    mesh, other = read_mesh(path), trimesh.load(path, process=False)
    assert_array_equal(np.sort(mesh.vertices[mesh.triangles].reshape(-1, 9), axis=0), np.sort(other.triangles.reshape(-1, 9), axis=0))
    assert len(merged(mesh)[0].vertices) <= len(mesh.vertices)


@pytest.mark.parametrize(
    ("folder", "name", "triangles", "volume", "omitted"),
    [
        ("line_face", "frame_0000.obj", 1280, 5.9397, 1),
        ("continuation_space", "frame_0000.obj", 1280, 5.9397, 0),
        ("stl_trailing", "frame_0000.stl", 1280, None, 0),
        ("blender_ply", "s_000.ply", 528, 4.8847, 0),
    ],
)
def test_reported_files_are_read(shared_data, folder, name, triangles, volume, omitted):
    path = shared_data("reports") / folder / name
    mesh, left_out = parse_frame(path.read_bytes(), path)
    assert (len(mesh.triangles), left_out) == (triangles, omitted)
    if volume:
        assert_allclose(signed_volume(mesh), volume, rtol=1e-4)
