"""Triangles without loss, by growing a region: about one symbol for each triangle.

In the manner of the cut-border machine (Gumhold & Strasser, SIGGRAPH 1998), gate after gate around one pivot vertex after another
(Touma & Gotsman, "Triangle mesh compression", GI 1998). The symbol of a gate adapts to how many triangles its two vertices have so
far. Any list of triangles can be coded: where neighbors do not fit together, a gate stays shut and a new region starts.
Vertices are numbered as they first appear.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

import numpy as np

from .coder import Coder

# Third vertex of the triangle behind a gate: new, of the border's next gate on either side, of both, any other; none.
NEW, BEFORE, AFTER, CLOSE, OLD, SHUT = range(6)
NEAR = 6  # ... and from here on, in turn, the vertices that are 2, 3, ... FARTHEST gates before and after
FARTHEST = 4
SYMBOLS = NEAR + 2 * (FARTHEST - 1)
MOST_COUNTED = 8  # triangles at a vertex that contexts tell apart
SEED_CONTEXT = (MOST_COUNTED + 1) ** 3 * 2  # for the vertices that a region starts with


class _Region:
    """The part that is known on both sides: its border gates in linked lists, and the triangles at each vertex so far."""

    def __init__(self) -> None:
        self.start: list[int] = []
        self.end: list[int] = []
        self.before: list[int] = []
        self.after: list[int] = []
        self.open: list[bool] = []
        self.waiting: deque[int] = deque()
        self.counts: list[int] = []
        self.leaving: dict[int, list[int]] = {}
        self.triangles: list[tuple[int, int, int]] = []

    def add_gate(self, start: int, end: int) -> int:
        self.start.append(start)
        self.end.append(end)
        self.before.append(-1)
        self.after.append(-1)
        self.open.append(True)
        self.waiting.append(len(self.start) - 1)
        self.leaving.setdefault(start, []).append(len(self.start) - 1)
        return len(self.start) - 1

    def link(self, first: int, second: int) -> None:
        self.after[first] = second
        self.before[second] = first

    def seed(self, a: int, b: int, c: int) -> None:
        """Starts a region with one triangle."""
        self._add_triangle(a, b, c)
        gates = [self.add_gate(*ends) for ends in ((a, b), (b, c), (c, a))]
        for index in range(3):
            self.link(gates[index], gates[(index + 1) % 3])

    def _add_triangle(self, a: int, b: int, c: int) -> None:
        self.triangles.append((a, b, c))
        for vertex in (a, b, c):
            self.counts[vertex] += 1

    def next_gate(self) -> int:
        """The oldest open gate, -1 when there is none."""
        while self.waiting:
            gate = self.waiting[0]
            if self.open[gate]:
                return gate
            self.waiting.popleft()
        return -1

    def context(self, gate: int) -> int:
        """What the symbol of a gate depends on."""
        counts, before, after = self.counts, self.before[gate], self.after[gate]
        ends = self.start[gate], self.end[gate], self.start[before]
        context = int(self.before[before] == after)
        for vertex in ends:
            context = context * (MOST_COUNTED + 1) + min(counts[vertex], MOST_COUNTED)
        return context

    def candidates(self, gate: int) -> tuple[int, int]:
        """The vertices that BEFORE and AFTER mean, -1 where there is none."""
        before, after = self.before[gate], self.after[gate]
        return (self.start[before] if self.open[before] else -1), (self.end[after] if self.open[after] else -1)

    def near(self, gate: int, symbol: int) -> tuple[int, int]:
        """The vertex that a symbol from NEAR on means, and the gate that leaves it."""
        step = self.before if (symbol - NEAR) % 2 == 0 else self.after
        for _ in range((symbol - NEAR) // 2 + 2):
            gate = step[gate]
        leaving = gate if step is self.before else self.after[gate]
        return self.start[leaving], leaving

    def grow(self, gate: int, symbol: int, third: int) -> int:
        """Puts a triangle behind a gate; returns the gate that goes on around the pivot, -1 where it is closed."""
        a, b = self.start[gate], self.end[gate]
        before, after = self.before[gate], self.after[gate]
        self.open[gate] = False
        self._add_triangle(b, a, third)
        if symbol == CLOSE:
            self.open[before] = self.open[after] = False
            return -1
        if symbol == BEFORE:
            return self._bridge(third, b, before, self.before[before], after)
        if symbol == AFTER:
            return self._bridge(a, third, after, before, self.after[after])
        through = self._gate_leaving(third) if symbol == OLD else self.near(gate, symbol)[1] if symbol >= NEAR else -1
        first, second = self.add_gate(a, third), self.add_gate(third, b)
        self.link(before, first)
        self.link(second, after)
        if through >= 0:  # the border splits here, or two borders merge
            self.link(self.before[through], second)
            self.link(first, through)
        else:
            self.link(first, second)
        return first

    def _gate_leaving(self, vertex: int) -> int:
        """The oldest open gate that starts at a vertex, -1 when there is none."""
        leaving = self.leaving[vertex] = [gate for gate in self.leaving.get(vertex, ()) if self.open[gate]]
        return leaving[0] if leaving else -1

    def _bridge(self, start: int, end: int, gone: int, before: int, after: int) -> int:
        """One gate in place of two; returns it."""
        self.open[gone] = False
        gate = self.add_gate(start, end)
        self.link(before, gate)
        self.link(gate, after)
        return gate

    def shut(self, gate: int) -> None:
        """No triangle comes behind this gate; it stays in its list, as its neighbors' ends are known by it."""
        self.open[gate] = False


def encoded_triangles(coder: Coder, triangles: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Codes (T, 3) triangles over `count` vertices; returns them as a decoder gets them, and the (V,) old number of each new vertex.

    No corner of a triangle may be twice the same vertex. Vertices without a triangle come last.
    """
    rows = [tuple(row) for row in triangles.tolist()]
    behind: dict[tuple[int, int], list[int]] = {}
    for index, (a, b, c) in enumerate(rows):
        for ends in ((a, b), (b, c), (c, a)):
            behind.setdefault(ends, []).append(index)
    originals: list[int] = []
    region, numbers, done = _Region(), [-1] * count, [False] * len(rows)

    def name(vertex: int) -> int:
        numbers[vertex] = len(originals)
        originals.append(vertex)
        region.counts.append(0)
        return numbers[vertex]

    for seed, row in enumerate(rows):
        if done[seed]:
            continue
        done[seed] = True
        for vertex in row:
            if coder.choice(int(numbers[vertex] >= 0), SEED_CONTEXT, 2):
                coder.number(numbers[vertex], len(originals))
            else:
                name(vertex)
        region.seed(*(numbers[vertex] for vertex in row))
        gate = region.next_gate()
        while gate >= 0 and len(region.triangles) < len(rows):
            a, b = originals[region.start[gate]], originals[region.end[gate]]
            index = next((index for index in behind.get((b, a), ()) if not done[index]), -1)
            if index < 0:
                coder.choice(SHUT, region.context(gate), SYMBOLS)
                region.shut(gate)
                gate = region.next_gate()
                continue
            done[index] = True
            third = next(vertex for vertex in rows[index] if vertex not in (a, b))
            symbol = _symbol(region, gate, numbers[third])
            coder.choice(symbol, region.context(gate), SYMBOLS)
            if symbol == OLD:
                coder.number(numbers[third], len(originals))
            gate = _following(region, region.grow(gate, symbol, name(third) if symbol == NEW else numbers[third]), region.start[gate])
    used = np.array(originals, dtype=np.int64)
    unused = np.setdiff1d(np.arange(count), used)
    return np.array(region.triangles, dtype=np.int64).reshape(-1, 3), np.concatenate([used, unused])


def decoded_triangles(coder: Coder, triangles: int, count: int) -> np.ndarray:
    """(T, 3) int64, what `encoded_triangles` coded. Raises ValueError where that cannot have been written by it."""
    region, gate = _Region(), -1
    while len(region.triangles) < triangles:
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


def _following(region: _Region, gate: int, pivot: int) -> int:
    """The next gate to look at: on around the pivot, else the oldest that is open."""
    return gate if gate >= 0 and region.start[gate] == pivot else region.next_gate()


def _symbol(region: _Region, gate: int, third: int) -> int:
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


def _third(coder: Coder, region: _Region, gate: int, symbol: int, count: int) -> int:
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


def _new_vertex(region: _Region, count: int) -> int:
    if len(region.counts) >= count:
        raise ValueError("there are more vertices than announced")
    region.counts.append(0)
    return len(region.counts) - 1


def _seed_vertex(coder: Coder, region: _Region, count: int) -> int:
    if coder.choice(None, SEED_CONTEXT, 2):
        if not region.counts:
            raise ValueError("a vertex is used before there is one")
        return coder.number(None, len(region.counts))
    return _new_vertex(region, count)
