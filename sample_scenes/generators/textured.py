"""Textured sequences with known colors: every frame has a mesh, an atlas, an exposure and noise of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from refmesh_addon.core.color.appearance import Appearance
from refmesh_addon.core.color.exposure import exposed
from refmesh_addon.core.color.layout import Layout
from refmesh_addon.core.color.texels import Texels
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.images import write_image
from refmesh_addon.pipeline.session.unwrapping import unwrapped

from .bodies import Sequence
from .materials import Material, blotches, checker, letters, waves
from .sequences import BALL_RADIUS, SEQUENCES

EXPOSURE_SWING = 0.12  # of the linear light, up and down over the take, with a phase of its own for each channel
NOISE = 1.5  # gray levels, standard deviation


@dataclass(frozen=True)
class TexturedFrame:
    """mesh, layout, image : (size, size, 3) uint8 as captured.  gain : (3,) linear gain that the exposure has applied."""

    mesh: TriangleMesh
    layout: Layout
    image: np.ndarray
    gain: np.ndarray

    @property
    def appearance(self) -> Appearance:
        """The frame as it is read from a file."""
        count = len(self.mesh.triangles)
        uvs, colors = self.layout.corners.astype(np.float32), np.full((count, 3, 3), 255, np.uint8)
        return Appearance(self.mesh, uvs, np.zeros(count, np.int32), colors, (self.image,))


@dataclass(frozen=True)
class TexturedSequence:
    """A sequence whose bodies have a material each, in their order."""

    sequence: Sequence
    materials: tuple[Material, ...]

    def color(self, points: np.ndarray, time: float) -> np.ndarray:
        """(N, 3) uint8 sRGB without exposure or noise, of (N, 3) surface points at that time."""
        labels = self.sequence.labels(points, time)
        return self.material_color(self.sequence.rest(points, labels, time), labels)

    def material_color(self, rest_points: np.ndarray, labels: np.ndarray) -> np.ndarray:
        """(N, 3) uint8 sRGB of rest points of the bodies `labels` (N,)."""
        result = np.empty((len(rest_points), 3))
        for index, material in enumerate(self.materials):
            result[labels == index] = material(rest_points[labels == index])
        return np.rint(255 * np.clip(result, 0.0, 1.0)).astype(np.uint8)

    def frame(self, time: float, seed: int, size: int) -> TexturedFrame:
        """The capture at that time, with a texture of `size` texels along a side. Raises RuntimeError where xatlas is missing."""
        mesh = self.sequence.frame(time, seed)
        layout = unwrapped(mesh)
        if layout is None:
            raise RuntimeError("textured samples need xatlas")
        texels, rng = Texels.of(layout, size), np.random.default_rng(seed)
        gain = 1.0 + EXPOSURE_SWING * np.sin(2 * np.pi * time + np.array([0.0, 0.4, 0.8]))
        colors = exposed(self.color(texels.points(mesh), time), gain)
        noisy = np.clip(np.rint(colors + rng.normal(0.0, NOISE, colors.shape)), 0, 255).astype(np.uint8)
        return TexturedFrame(mesh, layout, texels.image(noisy), gain)


def textured_grasp() -> TexturedSequence:
    """The hand, checkered on skin, and the ball, with letters: `grasp` in color. Millimeters."""
    skin = waves(90.0, ((0.78, 0.55, 0.42), (0.60, 0.36, 0.27)))
    squares = checker(7.0, ((1.0, 1.0, 1.0), (0.72, 0.80, 0.86)))
    hand = lambda points: skin(points) * squares(points)
    return TexturedSequence(SEQUENCES["grasp"](), (hand, lettered_ball()))


def textured_clasp() -> TexturedSequence:
    """A hand in a printed glove and the same ball. Millimeters."""
    return TexturedSequence(SEQUENCES["clasp"](), (printed(140.0), lettered_ball()))


def lettered_ball() -> Material:
    """Letters on slow waves, around a ball at the origin."""
    paper = waves(60.0, ((0.20, 0.38, 0.62), (0.28, 0.62, 0.58)))

    def page(points: np.ndarray) -> np.ndarray:
        """Longitude and latitude of the ball in cells of about two millimeters."""
        x, y, z = (points / np.maximum(np.linalg.norm(points, axis=1, keepdims=True), 1e-12)).T
        scale = BALL_RADIUS / 2.2
        return np.column_stack([np.arctan2(y, x) * scale, np.arcsin(np.clip(z, -1, 1)) * scale])

    return letters("REFMESH ", page, (0.96, 0.92, 0.80), paper)


def printed(reach: float) -> Material:
    """Cloth with blotches on slow waves.  reach : of the sequence, which sets the lengths of both."""
    cloth = waves(0.8 * reach, ((0.85, 0.65, 0.45), (0.45, 0.70, 0.85)))
    spots = blotches(0.12 * reach, ((1.0, 1.0, 1.0), (0.45, 0.40, 0.50)))
    return lambda points: cloth(points) * spots(points)


def textured_body(name: str) -> TexturedSequence:
    """A sequence whose bodies are all of one printed cloth."""
    sequence = SEQUENCES[name]()
    return TexturedSequence(sequence, (printed(sequence.reach),) * len(sequence.bodies))


TEXTURED: dict[str, Callable[[], TexturedSequence]] = {"grasp": textured_grasp, "clasp": textured_clasp}
TEXTURED |= {name: partial(textured_body, name) for name in ("tumble", "beam", "collide", "walk")}


def write_frame(folder: Path, stem: str, frame: TexturedFrame, extension: str = ".png", decimals: int = 3) -> None:
    """OBJ, MTL and picture, as exporters of captures write them.  decimals : of the vertices."""
    write_image(folder / f"{stem}{extension}", frame.image)
    (folder / f"{stem}.mtl").write_text(f"newmtl skin\nKd 1 1 1\nmap_Kd {stem}{extension}\n")
    lines = [f"mtllib {stem}.mtl", "usemtl skin"]
    lines += [f"v {x:.{decimals}f} {y:.{decimals}f} {z:.{decimals}f}" for x, y, z in np.round(frame.mesh.vertices, decimals) + 0.0]
    lines += [f"vt {u:.5f} {v:.5f}" for u, v in frame.layout.uvs]
    corners = zip(frame.mesh.triangles + 1, frame.layout.triangles + 1)
    lines += [f"f {a}/{d} {b}/{e} {c}/{f}" for (a, b, c), (d, e, f) in corners]
    (folder / f"{stem}.obj").write_text("\n".join(lines) + "\n")
