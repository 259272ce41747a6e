"""Damaged files: what intact ones become when bytes, numbers and lines of them are changed."""

from __future__ import annotations

import json

import numpy as np
import trimesh

BALL = trimesh.creation.icosphere(subdivisions=1)
_TEXT = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nmtllib scan.mtl\nusemtl skin\nf 1/1 2/2 3/1\nf -4 -2 -1\nl 1 2\nf 1 2 \\ \n3\n"
_MTL = "newmtl skin\nKd 1 0.5 0\nmap_Kd -s 1 1 1 -bm 0.5 skin.png\nmap_Bump bump.png\n"
_MIXED = (
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty double y\nproperty short z\nelement face 2\n"
    "property list uchar int vertex_indices\nproperty list uchar float texcoord\nelement tristrips 1\n"
    "property list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 0\n4 0 1 2 3 2 0.5 0.5\n5 0 1 -1 2 3\n"
)
SEEDS: dict[str, list[bytes]] = {
    "obj": [_TEXT.encode(), BALL.export(file_type="obj").encode()],
    "ply": [_MIXED.encode(), BALL.export(file_type="ply"), BALL.export(file_type="ply", encoding="ascii")],
    "stl": [BALL.export(file_type="stl"), BALL.export(file_type="stl_ascii").encode()],
    "glb": [BALL.export(file_type="glb")],
    "off": [BALL.export(file_type="off").encode()],
    "mtl": [_MTL.encode()],
}
NUMBERS = [
    b"0",
    b"-1",
    b"255",
    b"4294967295",
    b"99999999999",
    b"1e308",
    b"nan",
    b"-inf",
    b"1e-400",
    b"9" * 400,
    b"",
    b"\0",
    b"\\",
    b"[",
    b'"',
]


def damaged(kind: str, rng: np.random.Generator) -> bytes:
    """An intact file of a kind with one to three changes."""
    data = SEEDS[kind][rng.integers(len(SEEDS[kind]))]
    for _ in range(int(rng.integers(1, 4))):
        data = _CHANGES[rng.integers(len(_CHANGES))](data, rng)
    return data[:100_000]


def _bytes(data: bytes, rng: np.random.Generator) -> bytes:
    changed = bytearray(data or b"\0")
    for place in rng.integers(0, len(changed), 3):
        changed[place] = rng.integers(256)
    return bytes(changed)


def _number(data: bytes, rng: np.random.Generator) -> bytes:
    """Another number, or something else, in place of a word of the first lines, where headers are, or of any."""
    words = data[: 600 if rng.random() < 0.5 else len(data)].split(b" ")
    words[rng.integers(len(words))] = NUMBERS[rng.integers(len(NUMBERS))]
    shortened = b" ".join(words)
    return shortened if len(words) < 2 else shortened + data[600:] if len(shortened) < len(data) else shortened


def _cut(data: bytes, rng: np.random.Generator) -> bytes:
    return data[: rng.integers(len(data) + 1)]


def _repeated(data: bytes, rng: np.random.Generator) -> bytes:
    start = int(rng.integers(len(data) + 1))
    part = data[start : start + int(rng.integers(1, 60))]
    return data[:start] + part * int(rng.integers(2, 400)) + data[start:]


def _integer(data: bytes, rng: np.random.Generator) -> bytes:
    """Four bytes as an integer at the edge of its range."""
    place = int(rng.integers(len(data) + 1))
    return data[:place] + int(rng.choice([0, 1, 2**31 - 1, 2**31, 2**32 - 1])).to_bytes(4, "little") + data[place + 4 :]


def _json(data: bytes, rng: np.random.Generator) -> bytes:
    """Another value in the JSON of a GLB, with the lengths mended so that readers get to see it."""
    length = int.from_bytes(data[12:16], "little")
    try:
        gltf = json.loads(data[20 : 20 + length])
        key = list(gltf)[rng.integers(len(gltf))]
        entry = gltf[key][0] if isinstance(gltf[key], list) else gltf[key]
        entry[list(entry)[rng.integers(len(entry))]] = [None, -1, 10**9, "x", [], {}, 1e300, 0][rng.integers(8)]
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError):
        return _bytes(data, rng)
    text = json.dumps(gltf).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + length :]
    return data[:8] + (20 + len(text) + len(rest)).to_bytes(4, "little") + len(text).to_bytes(4, "little") + data[16:20] + text + rest


_CHANGES = (_bytes, _number, _cut, _repeated, _integer, _json)
