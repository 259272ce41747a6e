"""The GLB container: views of one binary chunk, accessors on them, and the JSON that names them.

Own code: the packages for this model the JSON as classes and bring a serializer with them, while all that is needed here is
to count offsets. What makes a file small, quantization and packed views, is the caller's in any case.
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .meshopt import encoded_attributes, encoded_triangles

_HEAD, _CHUNK = struct.Struct("<4sII"), struct.Struct("<I4s")
_MAGIC, _VERSION = b"glTF", 2
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
COMPONENTS = {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125, "float32": 5126}
SHAPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3"}
QUANTIZATION, MESHOPT = "KHR_mesh_quantization", "EXT_meshopt_compression"
FALLBACK = 1  # buffer that stands for what a reader of packed views unpacks


@dataclass
class Container:
    """A GLB file that is being put together.

    packed : whether vertices and triangles are packed by EXT_meshopt_compression.  content : what the JSON holds besides buffers, views,
    accessors and extensions.
    """

    packed: bool
    content: dict[str, Any] = field(default_factory=dict)
    _extensions: dict[str, bool] = field(default_factory=dict)
    _binary: bytearray = field(default_factory=bytearray)
    _unpacked: int = 0
    _views: list[dict] = field(default_factory=list)
    _accessors: list[dict] = field(default_factory=list)

    def __post_init__(self) -> None:
        if self.packed:
            self.extend(MESHOPT, required=True)

    def extend(self, extension: str, required: bool = False) -> None:
        """Declares an extension of glTF.  required : a reader without it cannot show the file."""
        self._extensions[extension] = required

    def entry(self, kind: str, item: dict) -> int:
        """Number of an entry of one of the document's lists, such as "materials"; equal entries are one."""
        entries = self.content.setdefault(kind, [])
        if item not in entries:
            entries.append(item)
        return entries.index(item)

    def raw(self, data: bytes) -> int:
        """Number of a view of bytes that no accessor reads, such as a picture."""
        return self._add_view(data, {})

    def values(self, array: np.ndarray) -> int:
        """Number of an accessor of plain float32 values, (N,) or (N, 3), with their bounds."""
        rows = np.ascontiguousarray(array, dtype="<f4").reshape(len(array), -1)
        view = self._add_view(rows.tobytes(), {})
        return self._add_accessor(view, 0, rows, bounds=True)

    def floats(self, array: np.ndarray) -> int:
        """Number of an accessor of (V, 2) or (V, 3) float32 values of vertices, with their bounds."""
        rows = array.astype("<f4")
        return self._add_accessor(self._add_view(rows.tobytes(), {"target": ARRAY_BUFFER}), 0, rows, bounds=True)

    def triangles(self, array: np.ndarray) -> int:
        """Number of an accessor of the corners of (T, 3) triangles."""
        corners = array.astype("<u2" if array.max(initial=0) < 0xFFFF else "<u4").reshape(-1, 1)
        if self.packed:
            view = self._add_packed(encoded_triangles(array), corners, "TRIANGLES", ELEMENT_ARRAY_BUFFER)
        else:
            view = self._add_view(corners.tobytes(), {"target": ELEMENT_ARRAY_BUFFER})
        return self._add_accessor(view, 0, corners)

    def vertices(self, arrays: list[np.ndarray], normalized: bool = False) -> list[int]:
        """Numbers of accessors of (V, 2) or (V, 3) integers of one type, one behind the other in a view, each on a multiple of 4 bytes.

        normalized : the largest integer stands for 1; else integers stand for themselves, bounds are given, and KHR_mesh_quantization is
        declared.
        """
        if not normalized:
            self.extend(QUANTIZATION, required=True)
        kind, width = arrays[0].dtype, arrays[0].shape[1]
        stride = -(-width * kind.itemsize // 4) * 4
        rows = np.zeros((sum(len(array) for array in arrays), stride // kind.itemsize), dtype=kind.newbyteorder("<"))
        rows[:, :width] = np.concatenate(arrays)
        if self.packed:
            view = self._add_packed(encoded_attributes(rows.view(np.uint8).reshape(len(rows), stride)), rows, "ATTRIBUTES", ARRAY_BUFFER)
        else:
            view = self._add_view(rows.tobytes(), {"byteStride": stride, "target": ARRAY_BUFFER})
        starts = np.cumsum([0, *(len(array) for array in arrays)])[:-1] * stride
        accessors = [self._add_accessor(view, int(start), array, not normalized) for start, array in zip(starts, arrays)]
        for accessor in accessors if normalized else []:
            self._accessors[accessor]["normalized"] = True
        return accessors

    def _add_packed(self, data: bytes, rows: np.ndarray, mode: str, target: int) -> int:
        """A view whose bytes lie packed in the binary chunk, and unpacked where a reader puts them."""
        stride, length = rows.dtype.itemsize * rows.shape[1], rows.nbytes
        place = {"buffer": 0, "byteOffset": self._append(data), "byteLength": len(data)}
        packed = {**place, "byteStride": stride, "mode": mode, "count": len(rows)}
        view = {"buffer": FALLBACK, "byteOffset": self._unpacked, "byteLength": length, "target": target, "extensions": {MESHOPT: packed}}
        if mode == "ATTRIBUTES":
            view["byteStride"] = stride
        self._unpacked += -(-length // 4) * 4
        self._views.append(view)
        return len(self._views) - 1

    def _add_view(self, data: bytes, more: dict) -> int:
        self._views.append({"buffer": 0, "byteOffset": self._append(data), "byteLength": len(data), **more})
        return len(self._views) - 1

    def _append(self, data: bytes) -> int:
        """Offset of bytes in the binary chunk, a multiple of 4."""
        self._binary += bytes(-len(self._binary) % 4)
        self._binary += data
        return len(self._binary) - len(data)

    def _add_accessor(self, view: int, offset: int, rows: np.ndarray, bounds: bool = False) -> int:
        accessor = {
            "bufferView": view,
            "componentType": COMPONENTS[rows.dtype.name],
            "count": len(rows),
            "type": SHAPES[rows.shape[1]],
        }
        if offset:
            accessor["byteOffset"] = offset
        if bounds:
            accessor |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self._accessors.append(accessor)
        return len(self._accessors) - 1

    def _declared(self) -> dict[str, list[str]]:
        """The extensions; an empty list is not allowed."""
        lists = {"extensionsUsed": [*self._extensions], "extensionsRequired": [name for name, needed in self._extensions.items() if needed]}
        return {key: names for key, names in lists.items() if names}

    def finished(self) -> bytes:
        """The whole file."""
        binary = bytes(self._binary) + bytes(-len(self._binary) % 4)
        buffers: list[dict] = [{"byteLength": len(binary)}]
        if self.packed:
            buffers.append({"byteLength": self._unpacked, "extensions": {MESHOPT: {"fallback": True}}})
        document = {
            "asset": {"version": "2.0", "generator": "RefMesh"},
            **self._declared(),
            **self.content,
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": buffers,
        }
        text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        chunks = _CHUNK.pack(len(text), b"JSON") + text + _CHUNK.pack(len(binary), b"BIN\0") + binary
        return _HEAD.pack(_MAGIC, _VERSION, _HEAD.size + len(chunks)) + chunks
