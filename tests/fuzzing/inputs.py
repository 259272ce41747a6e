"""Damaged files: what intact ones become when bytes, numbers and lines of them are changed."""

from __future__ import annotations

import io
import json
import struct
import zipfile
import zlib
from collections.abc import Iterator

import numpy as np

from refmesh_addon.io.refmesh_stream.layout import ENTRY, HEAD, INDEX, NUMBER, packed_head
from refmesh_addon.io.sealed_npz import seal

from .seeds import KEY, SEEDS

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


VALUES: list = [None, True, -1, 0, 10**30, 1e308, float("nan"), "", "x", "../y", "/etc/passwd", "a\0b", "\ud800"]
VALUES += [[], {}, [[]], [None], {"a": 1}]
MOST_BYTES = 100_000
SEALED = 0.8  # share of the damaged files with a checksum that get one that fits, as readers refuse the others at once


def damaged(kind: str, rng: np.random.Generator) -> bytes:
    """An intact file of a kind with one to three changes."""
    data = SEEDS[kind][rng.integers(len(SEEDS[kind]))]
    if kind in ("entry", "refmesh") and rng.random() < SEALED:
        return _resealed(kind, data, rng)
    return altered(kind, data, rng)


def altered(kind: str, data: bytes, rng: np.random.Generator) -> bytes:
    """A file of a kind with one to three changes."""
    changes = _JSON_CHANGES if kind in ("report", "findings", "job") else _CHANGES
    for _ in range(int(rng.integers(1, 4))):
        data = changes[rng.integers(len(changes))](data, rng)
    return data[:MOST_BYTES]


def _resealed(kind: str, data: bytes, rng: np.random.Generator) -> bytes:
    """Damage behind checksums that are right: a file that somebody wrote on purpose."""
    if kind == "entry":
        file = io.BytesIO(_npz(data, rng))
        seal(file, f"frame-{KEY[:12]}.npz")
        return file.getvalue()
    _, _, offset, length, _ = HEAD.unpack_from(data)
    body, index = bytearray(data[HEAD.size : offset]), bytearray(data[offset : offset + length])
    target = index if rng.random() < 0.2 else body
    changed = _CHANGES[rng.integers(2)](bytes(target), rng)[: len(target)].ljust(len(target), b"\0")
    target[:] = changed
    _fix_checksums(index, bytes(body))
    return packed_head(offset, bytes(index)) + bytes(body) + bytes(index)


def _fix_checksums(index: bytearray, body: bytes) -> None:
    """Of each group whose place in the file makes sense."""
    place = INDEX.size
    while place + ENTRY.size <= len(index):
        offset, size, _, frames = ENTRY.unpack_from(index, place)
        if HEAD.size <= offset and offset + size <= HEAD.size + len(body):
            struct.pack_into("<I", index, place + 12, zlib.crc32(body[offset - HEAD.size : offset - HEAD.size + size]))
        place += ENTRY.size + NUMBER.size * frames


def _npz(data: bytes, rng: np.random.Generator) -> bytes:
    """Other bytes in the arrays of an archive, or in their headers, with the archive's checksums mended; or other arrays."""
    file, result = io.BytesIO(data), io.BytesIO()
    with zipfile.ZipFile(file) as archive, zipfile.ZipFile(result, "w") as written:
        names = archive.namelist()
        chosen = names[rng.integers(len(names))]
        for name in names:
            content = archive.read(name)
            if name == chosen:
                change = rng.integers(4)
                content = _header(content, rng) if change == 0 else _bytes(content, rng) if change == 1 else _other_array(rng)
            if name != chosen or rng.random() < 0.9:
                written.writestr(name, content)
    return result.getvalue()


def _header(content: bytes, rng: np.random.Generator) -> bytes:
    """Another number in the header of an array."""
    length = int.from_bytes(content[8:10], "little") + 10
    digits = [place for place in range(10, length) if 48 <= content[place] < 58]
    place = digits[rng.integers(len(digits))]
    return content[:place] + b"%d" % rng.integers(10) + content[place + 1 :]


def _other_array(rng: np.random.Generator) -> bytes:
    file = io.BytesIO()
    shape = tuple(rng.integers(0, 4, rng.integers(4)).tolist())
    kind = ["<f8", "<f4", "<i4", "<i8", "?", "<U3", "<c16", "u1"][rng.integers(8)]
    np.save(file, np.full(shape, [0, 1, -1, 100][rng.integers(4)]).astype(kind))
    return file.getvalue()


def _value(data: bytes, rng: np.random.Generator) -> bytes:
    """Another value anywhere in a JSON file, or none."""
    try:
        tree = json.loads(data)
    except (ValueError, RecursionError):
        return _bytes(data, rng)
    places = list(_places(tree))
    if not places:
        return _bytes(data, rng)
    holder, key = places[rng.integers(len(places))]
    if rng.random() < 0.2:
        del holder[key]
    else:
        holder[key] = VALUES[rng.integers(len(VALUES))]
    return json.dumps(tree).encode()


def _places(value: object) -> Iterator[tuple]:
    for key, member in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield value, key
        yield from _places(member)


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
_JSON_CHANGES = (_value, _value, _value, _bytes, _number, _cut, _repeated)
