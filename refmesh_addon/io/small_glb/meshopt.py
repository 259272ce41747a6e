"""Encoders of EXT_meshopt_compression, appendix A: attributes (mode 0) and triangles (mode 1).

Own code, as no well-kept Python package writes these on all platforms: https://github.com/KhronosGroup/glTF, EXT_meshopt_compression.
"""

from __future__ import annotations

import numpy as np

GROUP = 16  # elements whose deltas are packed together
BLOCK_BYTES, BLOCK_ELEMENTS = 8192, 256  # greatest size of a block of elements
TAIL_BYTES = 32  # least size of the tail
ATTRIBUTES, TRIANGLES = b"\xa0", b"\xe1"  # first byte of each mode
FIFO = 16  # edges and vertices that triangles refer to
REMEMBERED_EDGES, REMEMBERED_VERTICES = 15, 13  # of which a code can name so many
NEW_TRIANGLE, EXPLICIT, EXPLICIT_FIRST = 0xF0, 0xFE, 0xFF  # codes of triangles without a known edge


def encoded_attributes(elements: np.ndarray) -> bytes:
    """Mode 0.  elements : (N, S) uint8 bytes of vertices, S a multiple of 4 and at most 256, N at least 1.

    Raises ValueError for other shapes.
    """
    count, stride = elements.shape
    if stride % 4 or not 4 <= stride <= 256 or not count:
        raise ValueError(f"elements must be (N, S) with S a multiple of 4 up to 256; got {elements.shape}")
    deltas = np.diff(elements, axis=0, prepend=elements[:1])  # uint8 arithmetic wraps around, as the format wants it
    zigzag = np.where(deltas & 0x80, ~(deltas << 1), deltas << 1).astype(np.uint8)
    size = min(BLOCK_BYTES // stride & ~(GROUP - 1), BLOCK_ELEMENTS)
    blocks = [_encoded_bytes(zigzag[start : start + size, place]) for start in range(0, count, size) for place in range(stride)]
    tail = bytes(max(0, TAIL_BYTES - stride)) + elements[0].tobytes()
    return ATTRIBUTES + b"".join(blocks) + tail


def _encoded_bytes(deltas: np.ndarray) -> bytes:
    """One byte of the elements in a block: how each group is packed, 2 bits each, then the groups."""
    groups = np.pad(deltas, (0, -len(deltas) % GROUP)).reshape(-1, GROUP)
    sizes = np.stack([np.where(groups.any(axis=1), 99, 0), 4 + (groups >= 3).sum(axis=1), 8 + (groups >= 15).sum(axis=1)])
    modes = np.argmin(np.vstack([sizes, np.full(len(groups), GROUP)]), axis=0)
    header = np.pad(modes, (0, -len(modes) % 4)).reshape(-1, 4) << np.array([0, 2, 4, 6])
    packed = [_packed_group(group, mode) for group, mode in zip(groups, modes.tolist()) if mode]
    return header.sum(axis=1).astype(np.uint8).tobytes() + b"".join(packed)


def _packed_group(group: np.ndarray, mode: int) -> bytes:
    """16 deltas in 2 or 4 bits each, with the larger ones behind, or in 8."""
    if mode == 3:
        return group.tobytes()
    bits = 2 * mode
    sentinel = (1 << bits) - 1
    digits = np.minimum(group, sentinel).reshape(-1, 8 // bits) << np.arange(8 - bits, -1, -bits)
    return digits.sum(axis=1).astype(np.uint8).tobytes() + group[group >= sentinel].tobytes()


class _Triangles:
    """The state that the encoder of triangles shares with a decoder."""

    def __init__(self) -> None:
        self.next, self.last = 0, 0
        self.edges: list[tuple[int, int]] = []
        self.vertices: list[int] = []
        self.codes, self.data = bytearray(), bytearray()

    def add(self, a: int, b: int, c: int) -> None:
        """One triangle; its first corner may become another one."""
        for place in range(min(len(self.edges), REMEMBERED_EDGES)):
            for corners in ((a, b, c), (b, c, a), (c, a, b)):
                if self.edges[-1 - place] == corners[:2]:
                    return self._add_to_edge(place, *corners)
        first = next((turned for turned in ((a, b, c), (b, c, a), (c, a, b)) if turned[0] == self.next), (a, b, c))
        return self._add_alone(*first)

    def _add_to_edge(self, place: int, a: int, b: int, c: int) -> None:
        known = self._known(c)
        if c == self.next:
            code, self.next = 0, self.next + 1
        elif 0 < known < REMEMBERED_VERTICES:
            code = known
        elif abs(c - self.last) == 1:
            code, self.last = (0xD if c < self.last else 0xE), c
        else:
            code = 0xF
            self._write_index(c)
        self.codes.append(place << 4 | code)
        self._push_edges((c, b), (a, c))
        if code == 0 or code >= 0xD:
            self._push_vertex(c)

    def _add_alone(self, a: int, b: int, c: int) -> None:
        if (a, b, c) == (self.next, self.next + 1, self.next + 2):
            self.codes.append(NEW_TRIANGLE)
            self.next += 3
            new = [a, b, c]
        else:
            self.codes.append(EXPLICIT if a == self.next else EXPLICIT_FIRST)
            new = self._explicit(a, b, c)
        self._push_edges((b, a), (c, b), (a, c))
        for vertex in new:
            self._push_vertex(vertex)

    def _explicit(self, a: int, b: int, c: int) -> list[int]:
        """Writes corners that are told one by one; returns those to remember.

        Two new ones never follow an old one, which would restart the numbering: `add` puts the first new corner first.
        """
        explicit, new, kinds = [], [a], []
        if a == self.next:
            self.next += 1
        else:
            explicit.append(a)
        for vertex in (b, c):
            known = self._known(vertex)
            if vertex == self.next:
                kinds.append(0)
                self.next += 1
            else:
                kinds.append(known + 1 if 0 <= known < REMEMBERED_VERTICES else 0xF)
            if kinds[-1] in (0, 0xF):
                new.append(vertex)
            if kinds[-1] == 0xF:
                explicit.append(vertex)
        self.data.append(kinds[0] << 4 | kinds[1])
        for vertex in explicit:
            self._write_index(vertex)
        return new

    def _known(self, vertex: int) -> int:
        """Place of a vertex among those remembered, the latest first; -1 where it is not."""
        recent = self.vertices[: -FIFO - 1 : -1]
        return recent.index(vertex) if vertex in recent else -1

    def _write_index(self, vertex: int) -> None:
        delta = vertex - self.last
        value = (delta << 1) ^ (delta >> 31)
        while value > 0x7F:  # five rounds at most
            self.data.append(value & 0x7F | 0x80)
            value >>= 7
        self.data.append(value)
        self.last = vertex

    def _push_edges(self, *edges: tuple[int, int]) -> None:
        self.edges = (self.edges + list(edges))[-FIFO:]

    def _push_vertex(self, vertex: int) -> None:
        self.vertices = (self.vertices + [vertex])[-FIFO:]


def encoded_triangles(triangles: np.ndarray) -> bytes:
    """Mode 1.  triangles : (T, 3) vertices; a decoder gets them in this order, some of them turned."""
    state = _Triangles()
    for a, b, c in triangles.tolist():
        state.add(a, b, c)
    table = bytes(16)  # of pairs that stand for common corners; only the first, two new ones, is used
    return TRIANGLES + bytes(state.codes) + bytes(state.data) + table
