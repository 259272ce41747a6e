"""Result types as flat tables of named arrays and back: the form in which caches, files and other processes hold them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from types import NoneType, UnionType
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from scipy import sparse

Arrays = dict[str, np.ndarray]
Result = TypeVar("Result")

SEPARATOR = "."  # between the name of a field and the name of what is inside it, as in "mesh.vertices"
CSR_PARTS = ("data", "indices", "indptr", "shape")


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
    """The result of type `kind` that `to_arrays` packed. Raises KeyError when a field is missing."""
    hints = get_type_hints(kind)
    return kind(**{item.name: _unpacked(item.name, hints[item.name], arrays) for item in fields(kind)})  # type: ignore[arg-type]


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


def _unpacked(name: str, hint: Any, arrays: Mapping[str, np.ndarray]) -> Any:
    prefix = name + SEPARATOR
    inner = {key.removeprefix(prefix): array for key, array in arrays.items() if key.startswith(prefix)}
    if get_origin(hint) in (Union, UnionType):
        if name not in arrays and not inner:
            return None
        (hint,) = (choice for choice in get_args(hint) if choice is not NoneType)
    if hint is sparse.csr_matrix:
        data, indices, indptr, shape = (inner[part] for part in CSR_PARTS)
        return sparse.csr_matrix((data, indices, indptr), tuple(shape.tolist()))
    if is_dataclass(hint):
        return from_arrays(hint, inner)  # type: ignore[arg-type]
    if get_origin(hint) is tuple:
        return tuple(arrays[name].tolist())
    return arrays[name] if hint is np.ndarray else hint(arrays[name].item())
