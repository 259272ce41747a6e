"""A plain reader of what is written: one value at a time, from the convention."""

import struct
import zlib

import numpy as np


def read_png(data):
    """(H, W, 3) of a PNG with 16 bits and no filters."""
    place, content = 8, b""
    while place < len(data):
        length, kind = struct.unpack_from(">I4s", data, place)
        body = data[place + 8 : place + 8 + length]
        assert zlib.crc32(kind + body) == struct.unpack_from(">I", data, place + 8 + length)[0]
        if kind == b"IHDR":
            width, height, depth, color = struct.unpack_from(">IIBB", body)
            assert (depth, color) == (16, 2)
        content += body if kind == b"IDAT" else b""
        place += 12 + length
    rows = np.frombuffer(zlib.decompress(content), np.uint8).reshape(height, 1 + 6 * width)
    assert not rows[:, 0].any()
    return rows[:, 1:].copy().view(">u2").reshape(height, width, 3)


def shown(glb, picture, normals, remap, frame):
    """Positions and normals of the mesh's vertices in a frame, in glTF's axes, as a shader of OpenVAT computes them."""
    attributes = glb.json["meshes"][0]["primitives"][0]["attributes"]
    base, uvs = glb.accessor(attributes["POSITION"]).astype(float), glb.accessor(attributes["TEXCOORD_1"]).astype(float)
    height, width = picture.shape[:2]
    columns, rows = np.floor(uvs[:, 0] * width).astype(int), np.floor(uvs[:, 1] * height).astype(int) + frame
    low, high = np.array(remap["os-remap"]["Min"]), np.array(remap["os-remap"]["Max"])
    x, y, z = (low + picture[rows, columns] / 65535.0 * (high - low)).T
    lower = normals if normals is not None else picture[height // 2 :]
    nx, ny, nz = (2.0 * lower[rows, columns] / 65535.0 - 1.0).T
    return base + np.column_stack([x, z, -y]), np.column_stack([nx, nz, -ny])
