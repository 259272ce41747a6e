"""What `write_ply` wrote comes back, whatever else a vertex carries."""

from __future__ import annotations

import numpy as np
import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.io.meshes import read_mesh, write_ply
from refmesh_addon.io.own_ply import read_colors, read_surface, read_velocities

from ..core.shapes import ball


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
    "damage, words",
    [
        (lambda path: path.unlink(), "cannot be read"),
        (lambda path: path.write_bytes(b""), "holds no colours"),
        (lambda path: path.write_bytes(path.read_bytes()[:300]), "holds no colours"),
        (lambda path: write_ply(path, ball(1)), "holds no colours"),
        (lambda path: path.write_text("ply\nformat ascii 1.0\nelement vertex 0\nend_header\n"), "holds no colours"),
    ],
)
def test_what_has_no_colors_is_refused_in_words(tmp_path, damage, words):
    mesh = ball(1)
    write_ply(tmp_path / "a.ply", mesh, np.zeros((len(mesh.vertices), 4), np.uint8))
    damage(tmp_path / "a.ply")
    with pytest.raises(RefMeshError, match=words):
        read_colors(tmp_path / "a.ply")


@pytest.mark.parametrize("colored, moving", [(False, False), (True, False), (True, True)])
def test_surfaces_come_back_as_the_reader_of_all_formats_has_them(tmp_path, colored, moving):
    mesh = ball(1)
    write_ply(tmp_path / "a.ply", mesh, np.zeros((len(mesh.vertices), 4), np.uint8) if colored else None, mesh.vertices if moving else None)
    found, expected = read_surface(tmp_path / "a.ply"), read_mesh(tmp_path / "a.ply")
    np.testing.assert_array_equal(found.vertices, expected.vertices)
    np.testing.assert_array_equal(found.triangles, expected.triangles)


@pytest.mark.parametrize("size", [0, 10, 300, -1])
def test_a_damaged_surface_is_refused_in_words(tmp_path, size):
    write_ply(tmp_path / "a.ply", ball(1))
    (tmp_path / "a.ply").write_bytes((tmp_path / "a.ply").read_bytes()[:size])
    with pytest.raises(RefMeshError, match="is damaged or was not written by RefMesh"):
        read_surface(tmp_path / "a.ply")
    (tmp_path / "a.ply").unlink()
    with pytest.raises(RefMeshError, match="cannot be read"):
        read_surface(tmp_path / "a.ply")
