"""Centers and texture layouts of a folder from elsewhere: as declared, or refused by the name of their file."""

import numpy as np
import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.findings import CENTER_ATTRIBUTES
from refmesh_addon.io.files import write_npz
from refmesh_addon.io.result_arrays import read_centers, read_layout

CENTERS = {
    "frames": np.array([4, 5]),
    "positions": np.arange(18.0).reshape(2, 3, 3),
    **{name: np.zeros(3) for name in CENTER_ATTRIBUTES},
    "group_000_reference_centers": np.zeros((3, 3)),
}


def test_centers_of_any_version_are_read_without_what_is_not_known(tmp_path):
    write_npz(tmp_path / "centers.npz", {**CENTERS, "center_indices": np.arange(3)})
    assert set(read_centers(tmp_path)) == set(CENTERS)
    write_npz(tmp_path / "centers.npz", {name: CENTERS[name] for name in ("frames", "positions")})
    assert set(read_centers(tmp_path)) == {"frames", "positions"}


def test_a_group_may_lack_centers_that_come_later(tmp_path):
    some = {"group_001_reference_centers": np.zeros((2, 3)), "group_001_center_indices": np.array([0, 2])}
    write_npz(tmp_path / "centers.npz", {**CENTERS, **some})
    assert set(read_centers(tmp_path)) == {*CENTERS, *some}


@pytest.mark.parametrize(
    "changed",
    [
        {"positions": np.zeros((2, 3))},
        {"positions": np.zeros((3, 3, 3))},
        {"positions": np.full((2, 3, 3), np.nan)},
        {"positions": np.empty((2, 0, 3)), **{name: np.zeros(0) for name in CENTER_ATTRIBUTES}},
        {"positions": np.full((2, 3, 3), "x")},
        {"frames": np.array([4.0, 5.0])},
        {"body": np.zeros(4)},
        {"group_000_reference_centers": np.zeros((2, 3))},
        {"group_000_reference_centers": np.zeros((2, 3)), "group_000_center_indices": np.array([0, 1, 2])},
        {"group_000_reference_centers": np.zeros((2, 3)), "group_000_center_indices": np.array([0, 3])},
    ],
)
def test_centers_of_another_shape_or_type_are_refused(tmp_path, changed):
    write_npz(tmp_path / "centers.npz", {**CENTERS, **changed})
    with pytest.raises(RefMeshError, match=r"centers\.npz: cannot be read \(.*run the steps again"):
        read_centers(tmp_path)


def test_layouts_are_those_of_a_mesh_with_as_many_triangles(tmp_path):
    path, uvs, triangles = tmp_path / "layout.npz", np.random.default_rng(0).random((5, 2)), np.array([[0, 1, 2], [2, 3, 4]], np.int32)
    write_npz(path, {"uvs": uvs, "triangles": triangles})
    for read, written in zip(read_layout(path, 2), (uvs, triangles), strict=True):
        np.testing.assert_array_equal(read, written)
    for count, arrays in ((3, {}), (2, {"uvs": uvs[:4]}), (2, {"uvs": np.full((5, 2), np.inf)}), (2, {"uvs": uvs.astype("U4")})):
        write_npz(path, {"uvs": uvs, "triangles": triangles, **arrays})
        with pytest.raises(RefMeshError, match=r"layout\.npz: (cannot be read|is the layout of another mesh)"):
            read_layout(path, count)
