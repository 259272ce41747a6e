"""Triangles without loss, by growing a region: about one symbol for each triangle.

In the manner of the cut-border machine (Gumhold & Strasser, SIGGRAPH 1998), gate after gate around one pivot vertex after another
(Touma & Gotsman, "Triangle mesh compression", GI 1998). The symbol of a gate adapts to how many triangles its vertices have so
far. Any list of triangles can be coded: where neighbors do not fit together, a gate stays shut and a new region starts.
Vertices are numbered as they first appear.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from .coder import Coder
from .region import AFTER, BEFORE, CLOSE, NEAR, NEW, OLD, SEED_CONTEXT, SHUT, SYMBOLS, Region


def encoded_triangles(coder: Coder, triangles: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Codes (T, 3) triangles over `count` vertices; returns them as a decoder gets them, and the (V,) old number of each new vertex.

    No corner of a triangle may be twice the same vertex. Vertices without a triangle come last.
    """
    encoder = _Encoder(coder, [(a, b, c) for a, b, c in triangles.tolist()], count)
    encoder.encode()
    used = np.array(encoder.originals, dtype=np.int64)
    unused = np.setdiff1d(np.arange(count), used)
    return np.array(encoder.region.triangles, dtype=np.int64).reshape(-1, 3), np.concatenate([used, unused])


class _Encoder:
    """What is left to be coded.  originals : the old number of each vertex that has a new one."""

    def __init__(self, coder: Coder, triangles: list[tuple[int, int, int]], count: int):
        self.region, self.originals = Region(), list[int]()
        self._coder, self._triangles = coder, triangles
        self._numbers, self._done = [-1] * count, [False] * len(triangles)
        self._at_edge: dict[tuple[int, int], list[int]] = {}
        for index, (a, b, c) in enumerate(triangles):
            for ends in ((a, b), (b, c), (c, a)):
                self._at_edge.setdefault(ends, []).append(index)

    def encode(self) -> None:
        """Grows a region from each triangle that no region has reached."""
        for index in range(len(self._triangles)):
            if self._done[index]:
                continue
            self._seed(index)
            gate = self.region.next_gate()
            while gate >= 0 and len(self.region.triangles) < len(self._triangles):  # each round adds a triangle or shuts a gate
                gate = self._passed(gate)

    def _seed(self, index: int) -> None:
        self._done[index] = True
        for vertex in self._triangles[index]:
            if self._coder.choice(int(self._numbers[vertex] >= 0), SEED_CONTEXT, 2):
                self._coder.number(self._numbers[vertex], len(self.originals))
            else:
                self._number(vertex)
        self.region.seed(*(self._numbers[vertex] for vertex in self._triangles[index]))

    def _number(self, vertex: int) -> int:
        """Gives a vertex its new number."""
        self._numbers[vertex] = len(self.originals)
        self.originals.append(vertex)
        self.region.counts.append(0)
        return self._numbers[vertex]

    def _passed(self, gate: int) -> int:
        """Codes what is behind a gate; returns the next one."""
        region = self.region
        start, end = self.originals[region.start[gate]], self.originals[region.end[gate]]
        index = next((index for index in self._at_edge.get((end, start), ()) if not self._done[index]), -1)
        if index < 0:
            self._coder.choice(SHUT, region.context(gate), SYMBOLS)
            region.shut(gate)
            return region.next_gate()
        self._done[index] = True
        third = next(vertex for vertex in self._triangles[index] if vertex not in (start, end))
        symbol = _symbol(region, gate, self._numbers[third])
        self._coder.choice(symbol, region.context(gate), SYMBOLS)
        if symbol == OLD:
            self._coder.number(self._numbers[third], len(self.originals))
        grown = region.grow(gate, symbol, self._number(third) if symbol == NEW else self._numbers[third])
        return _following(region, grown, region.start[gate])


def decoded_triangles(coder: Coder, triangles: int, count: int) -> np.ndarray:
    """(T, 3) int64, what `encoded_triangles` coded. Raises ValueError where that cannot have been written by it."""
    region, gate = Region(), -1
    while len(region.triangles) < triangles:  # ends: each round adds a triangle or shuts a gate
        if gate < 0:
            region.seed(*_distinct(_seed_vertex(coder, region, count) for _ in range(3)))
            gate = region.next_gate()
            continue
        symbol = coder.choice(None, region.context(gate), SYMBOLS)
        if symbol == SHUT:
            region.shut(gate)
            gate = region.next_gate()
            continue
        pivot = region.start[gate]
        gate = _following(region, region.grow(gate, symbol, _third(coder, region, gate, symbol, count)), pivot)
    return np.array(region.triangles, dtype=np.int64).reshape(-1, 3)


def _following(region: Region, gate: int, pivot: int) -> int:
    """The next gate to look at: on around the pivot, else the oldest that is open."""
    return gate if gate >= 0 and region.start[gate] == pivot else region.next_gate()


def _symbol(region: Region, gate: int, third: int) -> int:
    """How the third vertex of the triangle behind a gate is told; -1 for one that has no number yet."""
    if third < 0:
        return NEW
    before, after = region.candidates(gate)
    if third == before == after and region.before[region.before[gate]] == region.after[gate]:
        return CLOSE
    if third == before:
        return BEFORE
    if third == after:
        return AFTER
    return next((symbol for symbol in range(NEAR, SYMBOLS) if region.near(gate, symbol)[0] == third), OLD)


def _third(coder: Coder, region: Region, gate: int, symbol: int, count: int) -> int:
    before, after = region.candidates(gate)
    if symbol == NEW:
        return _new_vertex(region, count)
    if symbol >= NEAR:
        third = region.near(gate, symbol)[0]
    else:
        third = coder.number(None, len(region.counts)) if symbol == OLD else after if symbol == AFTER else before
    if third < 0 or third in (region.start[gate], region.end[gate]) or (symbol == CLOSE and before != after):
        raise ValueError("a triangle has no third vertex")
    return third


def _distinct(corners: Iterable[int]) -> list[int]:
    result = list(corners)
    if len(set(result)) < len(result):
        raise ValueError("a triangle has the same vertex twice")
    return result


def _new_vertex(region: Region, count: int) -> int:
    if len(region.counts) >= count:
        raise ValueError("there are more vertices than declared")
    region.counts.append(0)
    return len(region.counts) - 1


def _seed_vertex(coder: Coder, region: Region, count: int) -> int:
    if coder.choice(None, SEED_CONTEXT, 2):
        if not region.counts:
            raise ValueError("a vertex is used before there is one")
        return coder.number(None, len(region.counts))
    return _new_vertex(region, count)
