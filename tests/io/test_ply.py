"""What `write_ply` wrote comes back, whatever else a vertex carries."""

from __future__ import annotations

import io

import numpy as np
import pytest
import trimesh

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.ply import read_colors, read_surface, read_velocities, write_ply

from ..core.shapes import ball


@pytest.fixture
def surface():
    sphere = trimesh.creation.icosphere(subdivisions=2)
    return TriangleMesh(1.5 * sphere.vertices + [3, 4, 5], sphere.faces)


@pytest.mark.parametrize("moving", [False, True])
def test_colors_come_back(tmp_path, moving):
    mesh = ball(1)
    colors = np.random.default_rng(0).integers(0, 256, (len(mesh.vertices), 4)).astype(np.uint8)
    write_ply(tmp_path / "a.ply", mesh, colors, mesh.vertices if moving else None)
    np.testing.assert_array_equal(read_colors(tmp_path / "a.ply"), colors)


@pytest.mark.parametrize("colored", [False, True])
def test_velocities_come_back(tmp_path, colored):
    mesh = ball(1)
    colors = np.zeros((len(mesh.vertices), 4), np.uint8)
    write_ply(tmp_path / "a.ply", mesh, colors if colored else None, mesh.vertices)
    np.testing.assert_array_equal(read_velocities(tmp_path / "a.ply"), mesh.vertices.astype(np.float32))


def test_a_file_without_velocities_says_what_to_do(tmp_path):
    write_ply(tmp_path / "a.ply", ball(1))
    with pytest.raises(RefMeshError, match="a.ply: holds no velocities; run the Deform step first"):
        read_velocities(tmp_path / "a.ply")


@pytest.mark.parametrize(
    "damage, message",
    [
        (lambda path: path.unlink(), "cannot be read"),
        (lambda path: path.write_bytes(b""), "holds no colors"),
        (lambda path: path.write_bytes(path.read_bytes()[:300]), "holds no colors"),
        (lambda path: write_ply(path, ball(1)), "holds no colors"),
        (lambda path: path.write_text("ply\nformat ascii 1.0\nelement vertex 0\nend_header\n"), "holds no colors"),
    ],
)
def test_what_has_no_colors_is_refused(tmp_path, damage, message):
    mesh = ball(1)
    write_ply(tmp_path / "a.ply", mesh, np.zeros((len(mesh.vertices), 4), np.uint8))
    damage(tmp_path / "a.ply")
    with pytest.raises(RefMeshError, match=message):
        read_colors(tmp_path / "a.ply")


@pytest.mark.parametrize("colored, moving", [(False, False), (True, False), (True, True)])
def test_surfaces_come_back_as_the_reader_of_all_formats_has_them(tmp_path, colored, moving):
    mesh = ball(1)
    write_ply(tmp_path / "a.ply", mesh, np.zeros((len(mesh.vertices), 4), np.uint8) if colored else None, mesh.vertices if moving else None)
    stored, expected = read_surface(tmp_path / "a.ply"), read_mesh(tmp_path / "a.ply")
    np.testing.assert_array_equal(stored.vertices, expected.vertices)
    np.testing.assert_array_equal(stored.triangles, expected.triangles)


@pytest.mark.parametrize("size", [0, 10, 300, -1])
def test_a_damaged_surface_is_refused(tmp_path, size):
    write_ply(tmp_path / "a.ply", ball(1))
    (tmp_path / "a.ply").write_bytes((tmp_path / "a.ply").read_bytes()[:size])
    with pytest.raises(RefMeshError, match="is damaged or was not written by RefMesh"):
        read_surface(tmp_path / "a.ply")
    (tmp_path / "a.ply").unlink()
    with pytest.raises(RefMeshError, match="cannot be read"):
        read_surface(tmp_path / "a.ply")


def test_keeps_every_bit_and_order(tmp_path, surface):
    far = surface.moved(surface.vertices + 1e7 / 3)
    write_ply(tmp_path / "a.ply", far)
    mesh = read_mesh(tmp_path / "a.ply")
    np.testing.assert_array_equal(mesh.vertices, far.vertices)
    np.testing.assert_array_equal(mesh.triangles, far.triangles)
    write_ply(tmp_path / "b.ply", mesh)
    assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()


def test_colors_are_read_by_others(tmp_path, surface):
    colors = np.random.default_rng(1).integers(0, 256, (len(surface.vertices), 4), dtype=np.uint8)
    write_ply(tmp_path / "a.ply", surface, colors)
    other = trimesh.load(io.BytesIO((tmp_path / "a.ply").read_bytes()), file_type="ply", process=False)
    np.testing.assert_array_equal(other.visual.vertex_colors, colors)
    np.testing.assert_array_equal(other.vertices, surface.vertices)


@pytest.mark.parametrize("colored", [True, False])
def test_velocities_are_read_by_others(tmp_path, surface, colored):
    rng = np.random.default_rng(2)
    velocities = rng.normal(size=surface.vertices.shape)
    colors = rng.integers(0, 256, (len(surface.vertices), 4), dtype=np.uint8) if colored else None
    write_ply(tmp_path / "a.ply", surface, colors, velocities)
    other = trimesh.load(tmp_path / "a.ply", process=False)
    rows = other.metadata["_ply_raw"]["vertex"]["data"]
    np.testing.assert_array_equal(np.column_stack([rows[name] for name in ("vx", "vy", "vz")]), velocities.astype(np.float32))
    np.testing.assert_array_equal(other.vertices, surface.vertices)
    np.testing.assert_array_equal(read_mesh(tmp_path / "a.ply").triangles, surface.triangles)
    if colored:
        np.testing.assert_array_equal(read_colors(tmp_path / "a.ply"), colors)


def test_velocities_that_do_not_fit_are_refused(tmp_path, surface):
    with pytest.raises(ValueError, match="velocities must be"):
        write_ply(tmp_path / "a.ply", surface, velocities=np.zeros((3, 3)))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("colors", [np.zeros((3, 4), np.uint8), np.zeros((162, 3), np.uint8), np.zeros((162, 4))])
def test_colors_that_do_not_fit_are_refused(tmp_path, surface, colors):
    with pytest.raises(ValueError, match="colors must be"):
        write_ply(tmp_path / "a.ply", surface, colors)
    assert not list(tmp_path.iterdir())


def test_a_property_that_is_named_twice_is_refused(tmp_path, surface):
    path = tmp_path / "a.ply"
    write_ply(path, surface, np.full((len(surface.vertices), 4), 9, np.uint8))
    path.write_bytes(path.read_bytes().replace(b"property double y", b"property double x"))
    for read in (read_surface, read_colors):
        with pytest.raises(RefMeshError, match="a.ply: "):
            read(path)
