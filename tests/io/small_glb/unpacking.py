"""A plain decoder of EXT_meshopt_compression and of GLB files, written from the specifications, one value at a time."""

import json
import struct

import numpy as np

KINDS = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}


def unpacked_attributes(data, count, stride):
    assert data[0] == 0xA0
    previous, place, rows = list(data[-stride:]), 1, []
    most = min((8192 // stride) & ~15, 256)
    while len(rows) < count:
        size = min(most, count - len(rows))
        columns = []
        for byte in range(stride):
            deltas, place = _unpacked_bytes(data, place, -(-size // 16))
            column = []
            for delta in deltas[:size]:
                value = ~(delta >> 1) if delta & 1 else delta >> 1
                previous[byte] = (previous[byte] + value) & 0xFF
                column.append(previous[byte])
            columns.append(column)
        rows += list(zip(*columns))
    assert place == len(data) - max(32, stride)
    return np.array(rows, dtype=np.uint8)


def _unpacked_bytes(data, place, groups):
    header, place, result = data[place : place + -(-groups // 4)], place + -(-groups // 4), []
    for group in range(groups):
        mode = header[group // 4] >> 2 * (group % 4) & 3
        if mode == 0:
            result += [0] * 16
        elif mode == 3:
            result += data[place : place + 16]
            place += 16
        else:
            bits = 2 * mode
            packed, place = data[place : place + 2 * bits], place + 2 * bits
            for value in (byte >> shift & (1 << bits) - 1 for byte in packed for shift in range(8 - bits, -1, -bits)):
                if value == (1 << bits) - 1:
                    value, place = data[place], place + 1
                result.append(value)
    return result, place


def unpacked_triangles(data, count):
    assert data[0] == 0xE1
    codes, place, table = data[1 : 1 + count // 3], 1 + count // 3, data[-16:]
    new, last, edges, vertices, result = 0, 0, [], [], []

    def index():
        nonlocal place, last
        value = shift = 0
        while True:
            byte = data[place]
            place += 1
            value |= (byte & 0x7F) << shift
            shift += 7
            if not byte & 0x80:
                break
        last += ~(value >> 1) if value & 1 else value >> 1
        return last

    for code in codes:
        high, low = code >> 4, code & 15
        if high < 15:
            a, b = edges[-1 - high]
            if low == 0:
                c, new = new, new + 1
            elif low < 13:
                c = vertices[-1 - low]
            elif low < 15:
                c = last = last + (1 if low == 14 else -1)
            else:
                c = index()
            edges += [(c, b), (a, c)]
            vertices += [c] if low == 0 or low >= 13 else []
        else:
            if low < 14:
                kinds = table[low]
                a, new = new, new + 1
            else:
                kinds = data[place]
                place += 1
                assert kinds, "a restart of the numbering is not expected here"
                if low == 14:
                    a, new = new, new + 1
                else:
                    a = index()
            corners = []
            vertices_before = list(vertices)
            for kind in (kinds >> 4, kinds & 15):
                if kind == 0:
                    corners.append(new)
                    new += 1
                else:
                    corners.append(vertices_before[-kind] if kind < 15 else index())
            b, c = corners
            edges += [(b, a), (c, b), (a, c)]
            vertices.append(a)
            vertices += [corner for corner, kind in zip(corners, (kinds >> 4, kinds & 15)) if kind in (0, 15)]
        result.append((a, b, c))
    assert place == len(data) - 16
    return np.array(result)


class Glb:
    """A parsed GLB.  json : its document."""

    def __init__(self, data):
        magic, version, size = struct.unpack_from("<4sII", data)
        assert (magic, version, size) == (b"glTF", 2, len(data))
        length, kind = struct.unpack_from("<I4s", data, 12)
        assert kind == b"JSON" and length % 4 == 0
        self.json = json.loads(data[20 : 20 + length])
        self._binary = data[28 + length :]

    def accessor(self, number):
        """(N, width) values as they are stored."""
        accessor = self.json["accessors"][number]
        view = self.json["bufferViews"][accessor["bufferView"]]
        kind, width = np.dtype(KINDS[accessor["componentType"]]), WIDTHS[accessor["type"]]
        data, stride = self._view(view), view.get("byteStride", kind.itemsize * width)
        start = accessor.get("byteOffset", 0)
        rows = [np.frombuffer(data, kind, width, start + index * stride) for index in range(accessor["count"])]
        return np.array(rows).reshape(-1, width)

    def _view(self, view):
        packed = view.get("extensions", {}).get("EXT_meshopt_compression")
        place = packed or view
        data = self._binary[place["byteOffset"] : place["byteOffset"] + place["byteLength"]]
        if not packed:
            return data
        if packed["mode"] == "TRIANGLES":
            return unpacked_triangles(data, packed["count"]).astype({2: "<u2", 4: "<u4"}[packed["byteStride"]]).tobytes()
        return unpacked_attributes(data, packed["count"], packed["byteStride"]).tobytes()

    def at(self, time):
        """(vertices, triangles) of what is shown at a time."""
        weights = {index: node.get("weights") for index, node in enumerate(self.json["nodes"])}
        scales = {index: node.get("scale", [1, 1, 1]) for index, node in enumerate(self.json["nodes"])}
        for animation in self.json.get("animations", []):
            for channel in animation["channels"]:
                sampler, target = animation["samplers"][channel["sampler"]], channel["target"]
                times = self.accessor(sampler["input"]).ravel().astype(float)
                values = self.accessor(sampler["output"]).astype(float).reshape(len(times), -1)
                store = weights if target["path"] == "weights" else scales
                store[target["node"]] = _sampled(times, values, time, sampler["interpolation"])
        shown = [index for index in self.json["nodes"][0]["children"] if scales[index][0] == 1]
        assert len(shown) == 1, f"{len(shown)} groups are shown at {time}"
        body = self.json["nodes"][shown[0]]["children"][0]
        vertices, triangles = self._mesh(self.json["nodes"][body], weights[body])
        place = np.array(self.json["nodes"][0]["matrix"]).reshape(4, 4).T
        return vertices @ place[:3, :3].T + place[:3, 3], triangles

    def _mesh(self, node, weights):
        mesh = self.json["meshes"][node["mesh"]]
        primitive = mesh["primitives"][0]
        points = self.accessor(primitive["attributes"]["POSITION"]).astype(float)
        weights = mesh.get("weights", []) if weights is None else weights
        for weight, target in zip(weights, primitive.get("targets", [])):
            points = points + weight * self.accessor(target["POSITION"])
        triangles = self.accessor(primitive["indices"]).astype(int).reshape(-1, 3)
        return points * node["scale"] + node["translation"], triangles


def _sampled(times, values, time, interpolation):
    if interpolation == "STEP":
        return values[max(np.searchsorted(times, time, side="right") - 1, 0)]
    return np.array([np.interp(time, times, column) for column in values.T])
