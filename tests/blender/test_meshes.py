"""Arrays to Blender and back."""

from __future__ import annotations

import numpy as np
import pytest

from refmesh_addon.bridge.scene.meshes import COLOR_NAME, fill_mesh, fill_points, read_positions, set_colors

from .conftest import read_triangles, reference


@pytest.fixture
def target(blender):
    return blender.data.meshes.new("target")


def test_what_goes_in_comes_out(target):
    for index in (1, 0):  # the second has fewer vertices: nothing of the first may stay
        mesh = reference(index)
        fill_mesh(target, mesh)
        np.testing.assert_array_equal(read_positions(target), mesh.vertices.astype(np.float32))
        np.testing.assert_array_equal(read_triangles(target), mesh.triangles)
        assert not target.validate()


def test_filling_keeps_materials(blender, target):
    target.materials.append(blender.data.materials.new("mine"))
    fill_mesh(target, reference(0))
    assert [material.name for material in target.materials] == ["mine"]


def test_points_have_neither_edges_nor_faces(target):
    fill_mesh(target, reference(0))
    fill_points(target, np.eye(3))
    assert (len(target.vertices), len(target.edges), len(target.polygons)) == (3, 0, 0)


def test_colors_come_back_and_are_replaced(target):
    fill_points(target, np.eye(3))
    for shade in (0.25, 0.75):
        set_colors(target, np.full((3, 4), shade))
    read = np.empty(12, dtype=np.float32)
    target.attributes[COLOR_NAME].data.foreach_get("color", read)
    assert np.all(read == 0.75) and len(target.color_attributes) == 1
