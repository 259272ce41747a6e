"""Result types survive being packed as arrays, whatever their fields are."""

import io
from dataclasses import dataclass, fields, replace
from typing import Annotated

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy import sparse

from refmesh_addon.core.arrays import from_arrays, to_arrays
from refmesh_addon.core.types import FrozenArrays, TriangleMesh

MESH = TriangleMesh([[0, 0, 0], [3, 0, 0], [0, 4, 0]], [[0, 1, 2]])


@dataclass(frozen=True)
class Inner(FrozenArrays):
    mesh: TriangleMesh
    name: str


@dataclass(frozen=True)
class Everything(FrozenArrays):
    values: np.ndarray
    flags: np.ndarray
    count: int
    share: float
    closed: bool
    text: str
    names: tuple[str, ...]
    figures: tuple[float, ...]
    affinity: sparse.csr_matrix
    inner: Inner
    absent: np.ndarray | None = None
    present: Inner | None = None


@pytest.fixture
def everything():
    return Everything(
        values=np.arange(6.0).reshape(2, 3),
        flags=np.array([True, False]),
        count=3,
        share=0.25,
        closed=True,
        text="größer",
        names=("a.png", "b"),
        figures=(1.5, -2.0),
        affinity=sparse.random(5, 4, 0.4, format="csr", random_state=0),
        inner=Inner(MESH, "first"),
        present=Inner(MESH.moved(MESH.vertices + 1), ""),
    )


def through_a_file(result):
    file = io.BytesIO()
    np.savez(file, **to_arrays(result))
    file.seek(0)
    with np.load(file, allow_pickle=False) as archive:
        return from_arrays(type(result), {name: archive[name] for name in archive.files})


def assert_equal(first, second):
    assert type(first) is type(second)
    for item in fields(first):
        one, other = getattr(first, item.name), getattr(second, item.name)
        if sparse.issparse(one):
            assert one.shape == other.shape and (one != other).nnz == 0
        elif hasattr(one, "__dataclass_fields__"):
            assert_equal(one, other)
        elif isinstance(one, np.ndarray):
            assert one.dtype == other.dtype
            assert_array_equal(one, other)
        else:
            assert type(one) is type(other) and one == other


def test_every_field_comes_back_from_a_file_with_its_type(everything):
    assert_equal(everything, through_a_file(everything))


def test_results_from_a_file_are_read_only(everything):
    with pytest.raises(ValueError, match="read-only"):
        through_a_file(everything).values[0] = 1.0


def test_equal_matrices_are_packed_alike_however_they_are_stored():
    sorted_matrix = sparse.csr_matrix(([1.0, 2.0], [0, 2], [0, 2]), (1, 3))
    unsorted_matrix = sparse.csr_matrix(([2.0, 1.0], [2, 0], [0, 2]), (1, 3))

    @dataclass(frozen=True)
    class Holder:
        matrix: sparse.csr_matrix

    first, second = to_arrays(Holder(sorted_matrix)), to_arrays(Holder(unsorted_matrix))
    for name in first:
        assert_array_equal(first[name], second[name])
    assert_array_equal(unsorted_matrix.indices, [2, 0], "the matrix that was packed stays as it was")


def test_an_empty_tuple_comes_back_empty(everything):
    assert through_a_file(replace(everything, names=(), figures=())).names == ()


def test_what_is_no_array_is_refused_by_name():
    @dataclass(frozen=True)
    class Wrong:
        table: dict

    with pytest.raises(TypeError, match="'table'.*dict"):
        to_arrays(Wrong({"a": 1}))


def test_a_missing_field_is_an_error(everything):
    arrays = to_arrays(everything)
    del arrays["inner.mesh.vertices"]
    with pytest.raises(KeyError, match="vertices"):
        from_arrays(Everything, arrays)


@dataclass(frozen=True)
class Declared(FrozenArrays):
    mesh: TriangleMesh
    errors: Annotated[np.ndarray, "(V) float64"]
    more: Annotated[np.ndarray, "(V, 2) float32"] | None = None


@pytest.mark.parametrize(
    "changed",
    [
        {"mesh.vertices": np.zeros((3, 3), np.float32)},
        {"mesh.triangles": np.array([[0, 1, 3]], np.int32)},
        {"errors": np.zeros((3, 1))},
        {"more": np.zeros((2, 2), np.float32)},
        {"foreign": np.zeros(3)},
        {"mesh.foreign": np.zeros(3)},
    ],
)
def test_arrays_of_another_shape_or_type_or_name_are_refused(changed):
    arrays = to_arrays(Declared(MESH, np.zeros(3)))
    assert_equal(from_arrays(Declared, arrays), Declared(MESH, np.zeros(3)))
    with pytest.raises(ValueError, match=next(iter(changed)).split(".")[-1]):
        from_arrays(Declared, {**arrays, **changed})


@pytest.mark.parametrize(
    "changed",
    [
        {"count": np.array(1.5)},
        {"count": np.array([3])},
        {"text": np.array(3)},
        {"closed": np.array(1)},
        {"names": np.array([1, 2])},
        {"affinity.indices": np.array([9] * 8)},
        {"affinity.shape": np.array([5.0, 4.0])},
    ],
)
def test_numbers_texts_and_matrices_are_held_against_their_types(everything, changed):
    with pytest.raises((ValueError, TypeError)):
        from_arrays(Everything, {**to_arrays(everything), **changed})
