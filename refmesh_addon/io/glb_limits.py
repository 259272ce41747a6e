"""What is checked of a GLB before a library reads it: nesting, counts against the bytes that are there, and compression."""

from __future__ import annotations

import json
import re
import struct

_HEADER = struct.Struct("<4sIIII")  # magic, version, length, length and type of the first chunk
_JSON_CHUNK = 0x4E4F534A
_COMPONENT_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
# Vertices and indices that all primitives may have together, and that each byte of the file may stand for beyond.
FREE_ELEMENTS, ELEMENTS_PER_BYTE = 2_000_000, 4
MOST_NESTED = 64  # levels of JSON; glTF needs about ten
# Compression that no reader here undoes -> how a person gets a file that can be read.
COMPRESSIONS = {
    "KHR_draco_mesh_compression": "its meshes are Draco-compressed, which is not read: export it again without compression (in Blender: "
    "glTF export, Data, turn off Compression), or run 'gltf-transform copy IN.glb OUT.glb', which decompresses it",
    "EXT_meshopt_compression": "its meshes are compressed by meshoptimizer, which is not read: export it again without compression, "
    "or run 'gltf-transform copy IN.glb OUT.glb', which decompresses it",
}


def check_glb(data: bytes) -> None:
    """Raises ValueError, saying what is wrong, for a GLB that is damaged, compressed, or declares more than it holds."""
    gltf = _gltf(data)
    used = [*_list(gltf, "extensionsRequired"), *_list(gltf, "extensionsUsed")]
    for extension, remedy in COMPRESSIONS.items():
        if extension in used:
            raise ValueError(remedy)
    for index, accessor in enumerate(_list(gltf, "accessors")):
        _check_count(accessor, f"accessor {index}", len(data))
    _check_primitives(gltf, len(data))
    for index, view in enumerate(_list(gltf, "bufferViews")):
        length = view.get("byteLength") if isinstance(view, dict) else None
        if not isinstance(length, int) or not 0 <= length <= len(data):
            raise ValueError(f"bufferView {index} declares {length} bytes, the file has {len(data)}")


def _gltf(data: bytes) -> dict:
    """The JSON of the first chunk."""
    if len(data) < _HEADER.size:
        raise ValueError("it is too short for a GLB; is it truncated?")
    magic, _, length, chunk, kind = _HEADER.unpack_from(data)
    if magic != b"glTF" or kind != _JSON_CHUNK:
        raise ValueError("it has no glTF header; is it really a GLB file?")
    if length > len(data) or chunk > len(data) - _HEADER.size:
        raise ValueError(f"it is truncated: its header declares {length} bytes, {len(data)} are there")
    text = data[_HEADER.size : _HEADER.size + chunk]
    if _depth(text) > MOST_NESTED:
        raise ValueError(f"its JSON is nested more than {MOST_NESTED} levels deep")
    gltf = json.loads(text)
    if not isinstance(gltf, dict):
        raise ValueError("its JSON is not an object")
    return gltf


def _depth(text: bytes) -> int:
    """Levels of nesting."""
    depth = deepest = 0
    for bracket in re.findall(rb"[\[\]{}]", re.sub(rb'"(?:[^"\\]|\\.)*"', b"", text)):
        depth += 1 if bracket in b"[{" else -1
        deepest = max(deepest, depth)
    return deepest


def _check_count(accessor: object, name: str, size: int) -> None:
    if not isinstance(accessor, dict):
        raise ValueError(f"{name} is not an object")
    count = accessor.get("count")
    component = accessor.get("componentType")
    width = _COMPONENT_BYTES.get(component if isinstance(component, int) else 0, 1) * _COMPONENTS.get(str(accessor.get("type")), 1)
    # One without a bufferView is all zeros, but a mesh that uses it has indices of that number, which take bytes.
    least = width if "bufferView" in accessor else 1
    if not isinstance(count, int) or not 0 <= count * least <= size:
        raise ValueError(f"{name} declares {count} values of {width} bytes, more than the {size} bytes of the file hold")


def _check_primitives(gltf: dict, size: int) -> None:
    """Primitives may share their accessors, but each gets vertices and triangles of its own."""
    counts = [accessor["count"] for accessor in _list(gltf, "accessors")]
    total = 0
    for mesh in _list(gltf, "meshes"):
        for primitive in _list(mesh, "primitives") if isinstance(mesh, dict) else ():
            attributes = primitive.get("attributes") if isinstance(primitive, dict) else None
            used = [attributes.get("POSITION"), primitive.get("indices")] if isinstance(attributes, dict) else []
            total += sum(counts[index] for index in used if isinstance(index, int) and 0 <= index < len(counts))
    if total > max(FREE_ELEMENTS, ELEMENTS_PER_BYTE * size):
        raise ValueError(f"its primitives have {total} vertices and indices together, far more than {size} bytes hold")


def _list(gltf: dict, name: str) -> list:
    value = gltf.get(name, [])
    if not isinstance(value, list):
        raise ValueError(f"'{name}' is not a list")
    return value
