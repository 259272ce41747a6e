"""Material colors that are known at every point of a body: slow waves, a checker, letters, and blotches."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

# (N, 3) rest points -> (N, 3) sRGB, 0 to 1
Material = Callable[[np.ndarray], np.ndarray]

# Glyphs of five by seven cells, row by row from the top.
GLYPHS = {
    "R": ("####.", "#...#", "#...#", "####.", "#.#..", "#..#.", "#...#"),
    "E": ("#####", "#....", "#....", "####.", "#....", "#....", "#####"),
    "F": ("#####", "#....", "#....", "####.", "#....", "#....", "#...."),
    "M": ("#...#", "##.##", "#.#.#", "#.#.#", "#...#", "#...#", "#...#"),
    "S": (".####", "#....", "#....", ".###.", "....#", "....#", "####."),
    "H": ("#...#", "#...#", "#...#", "#####", "#...#", "#...#", "#...#"),
    " ": (".....",) * 7,
}
ADVANCE = 6  # cells from one letter to the next
LINE = 9  # cells from one line to the next


def waves(length: float, colors: tuple[tuple[float, float, float], tuple[float, float, float]]) -> Material:
    """Slow blends of two colors along all three axes.  length : of a wave."""
    first, second = np.array(colors)

    def color(points: np.ndarray) -> np.ndarray:
        phases = points * (2 * np.pi / length) + [0.0, 1.0, 2.0]
        share = 0.5 + np.sin(phases).sum(axis=1) / 6
        return first + share[:, None] * (second - first)

    return color


def checker(cell: float, colors: tuple[tuple[float, float, float], tuple[float, float, float]]) -> Material:
    """Cubes of two colors.  cell : their side."""
    first, second = np.array(colors)

    def color(points: np.ndarray) -> np.ndarray:
        odd = np.floor(points / cell + 0.25).astype(int).sum(axis=1) % 2
        return np.where(odd[:, None] == 1, second, first)

    return color


def blotches(length: float, colors: tuple[tuple[float, float, float], tuple[float, float, float]]) -> Material:
    """Spots of two colors, as on printed cloth, that repeat nowhere nearby: the sign of waves in six directions.  length : of a wave."""
    first, second = np.array(colors)
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(6, 3))
    directions *= (2 * np.pi / length) * rng.uniform(0.7, 1.4, (6, 1)) / np.linalg.norm(directions, axis=1, keepdims=True)
    phases = rng.uniform(0, 2 * np.pi, 6)

    def color(points: np.ndarray) -> np.ndarray:
        dark = np.sin(points @ directions.T + phases).sum(axis=1) > 0
        return np.where(dark[:, None], second, first)

    return color


def letters(text: str, around: Callable[[np.ndarray], np.ndarray], ink: tuple[float, float, float], paper: Material) -> Material:
    """Text that is repeated line after line.  around : (N, 3) points -> (N, 2) place on the page, cells to the right and up."""
    page = _page(text)

    def color(points: np.ndarray) -> np.ndarray:
        column, row = np.floor(around(points)).astype(int).T
        drawn = page[(-row - 1) % page.shape[0], column % page.shape[1]]
        return np.where(drawn[:, None], np.array(ink), paper(points))

    return color


def _page(text: str) -> np.ndarray:
    """(LINE, cells) bool of a text, top row first."""
    page = np.zeros((LINE, ADVANCE * len(text)), bool)
    for index, letter in enumerate(text):
        rows = GLYPHS[letter]
        page[: len(rows), index * ADVANCE : index * ADVANCE + len(rows[0])] = [[cell == "#" for cell in row] for row in rows]
    return page
