"""Result types as flat tables of named arrays and back: the form in which caches, files and other processes hold them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from types import NoneType, UnionType
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from scipy import sparse

from .array_layout import LayoutCheck

Arrays = dict[str, np.ndarray]
Result = TypeVar("Result")

SEPARATOR = "."  # between the name of a field and the name of what is inside it, as in "mesh.vertices"
CSR_PARTS = ("data", "indices", "indptr", "shape")
_KINDS = {bool: "b", int: "iu", float: "fiu", str: "U"}  # of NumPy types that hold a Python type


def to_arrays(result: Any) -> Arrays:
    """The fields of a result dataclass as named arrays.

    Fields may be arrays, numbers, texts, tuples of numbers or of texts, sparse matrices (kept in CSR form with sorted indices),
    dataclasses of these, or None, which is left out. Raises TypeError, naming the field, for anything else.

    >>> from refmesh_addon.core.types import TriangleMesh
    >>> to_arrays(TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))["triangles"]
    array([[0, 1, 2]], dtype=int32)
    """
    arrays: Arrays = {}
    for item in fields(result):
        arrays |= _packed(item.name, getattr(result, item.name))
    return arrays


def from_arrays(kind: type[Result], arrays: Mapping[str, np.ndarray]) -> Result:
    """The result of type `kind` that `to_arrays` packed.

    Raises KeyError when a field is missing, and ValueError, naming it, where one is not of its type, or an array belongs to no field.
    """
    hints, check = _hints(kind), LayoutCheck()  # type: ignore[arg-type]
    foreign = [name for name in arrays if name.partition(SEPARATOR)[0] not in hints]
    if foreign:
        raise ValueError(f"'{foreign[0]}' is not part of a {kind.__name__}")
    return kind(**{item.name: _unpacked(item.name, hints[item.name], arrays, check) for item in fields(kind)})  # type: ignore[arg-type]


@cache
def _hints(kind: type) -> dict[str, Any]:
    return get_type_hints(kind, include_extras=True)


def _packed(name: str, value: Any) -> Arrays:
    if value is None:
        return {}
    if sparse.issparse(value):
        return _packed_csr(name, value.tocsr(copy=True))
    if is_dataclass(value):
        return {name + SEPARATOR + inner: array for inner, array in to_arrays(value).items()}
    array = np.asarray(value)
    if array.dtype.hasobject:
        raise TypeError(f"'{name}' cannot be kept as an array: it is a {type(value).__name__}")
    return {name: array}


def _packed_csr(name: str, matrix: sparse.csr_matrix) -> Arrays:
    matrix.sum_duplicates()  # sorts the indices too: equal matrices give equal bytes
    return {name + SEPARATOR + part: np.asarray(getattr(matrix, part)) for part in CSR_PARTS}


def _unpacked(name: str, hint: Any, arrays: Mapping[str, np.ndarray], check: LayoutCheck) -> Any:
    prefix = name + SEPARATOR
    inner = {key.removeprefix(prefix): array for key, array in arrays.items() if key.startswith(prefix)}
    if get_origin(hint) in (Union, UnionType):
        if name not in arrays and not inner:
            return None
        (hint,) = (choice for choice in get_args(hint) if choice is not NoneType)
    if get_origin(hint) is Annotated:
        check.check(name, arrays[name], hint.__metadata__[0])
        return arrays[name]
    if hint is sparse.csr_matrix:
        return _unpacked_csr(name, inner)
    if is_dataclass(hint):
        return from_arrays(hint, inner)  # type: ignore[arg-type]
    if get_origin(hint) is tuple:
        return tuple(_of_kind(name, arrays[name], get_args(hint)[0], 1).tolist())
    return arrays[name] if hint is np.ndarray else hint(_of_kind(name, arrays[name], hint, 0).item())


def _unpacked_csr(name: str, parts: Mapping[str, np.ndarray]) -> sparse.csr_matrix:
    data, indices, indptr, shape = (parts[part] for part in CSR_PARTS)
    if shape.shape != (2,) or shape.dtype.kind != "i":
        raise ValueError(f"'{name}' is not a matrix")
    matrix = sparse.csr_matrix((data, indices, indptr), tuple(shape.tolist()))
    matrix.check_format(full_check=True)
    return matrix


def _of_kind(name: str, array: np.ndarray, kind: type, dimensions: int) -> np.ndarray:
    """A number or a text, or a row of them, as it was packed; an empty row is one of numbers."""
    if array.ndim != dimensions or (array.size and array.dtype.kind not in _KINDS[kind]):
        raise ValueError(f"'{name}' is {array.shape} {array.dtype}, not {'a row of ' * dimensions}{kind.__name__}")
    return array
