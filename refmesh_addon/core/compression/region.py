"""A part of a surface that grows triangle by triangle, the same for an encoder and a decoder of its connectivity."""

from __future__ import annotations

from collections import deque

# Third vertex of the triangle behind a gate: new, of the border's next gate on either side, of both, any other; none.
NEW, BEFORE, AFTER, CLOSE, OLD, SHUT = range(6)
NEAR = 6  # ... and from here on, in turn, the vertices that are 2, 3, ... FARTHEST gates before and after
FARTHEST = 4
SYMBOLS = NEAR + 2 * (FARTHEST - 1)
MOST_COUNTED = 8  # triangles at a vertex that contexts tell apart
SEED_CONTEXT = (MOST_COUNTED + 1) ** 3 * 2  # for the vertices that a region starts with



class Region:
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
        """A new gate, not in any list yet; returns it."""
        self.start.append(start)
        self.end.append(end)
        self.before.append(-1)
        self.after.append(-1)
        self.open.append(True)
        self.waiting.append(len(self.start) - 1)
        self.leaving.setdefault(start, []).append(len(self.start) - 1)
        return len(self.start) - 1

    def link(self, first: int, second: int) -> None:
        """Puts one gate behind another."""
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
        while self.waiting:  # each round takes one out
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

    def _bridge(self, start: int, end: int, closed: int, before: int, after: int) -> int:
        """One gate in place of two; returns it."""
        self.open[closed] = False
        gate = self.add_gate(start, end)
        self.link(before, gate)
        self.link(gate, after)
        return gate

    def shut(self, gate: int) -> None:
        """No triangle comes behind this gate; it stays in its list, as its neighbors' ends are known by it."""
        self.open[gate] = False
