"""The reconstructions that `--reconstruction` chooses from, by name."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...core.geometry.closest_point import SurfaceIndex
from ...core.reference.capture_density import CaptureDensity, as_fine_as
from ...core.reference.group import GroupSurface, ReferenceMesh, build_reference, with_features
from ...core.surfacing.edge_flips import regularized
from ...core.surfacing.reconstruction import screened_poisson
from ...core.types import TriangleMesh
from . import meshlab


def published(points: np.ndarray, normals: np.ndarray, depth: int) -> TriangleMesh:
    """PyMeshLab's screened Poisson reconstruction without the slivers of its marching cubes, which would stop edge collapses."""
    surface = meshlab.screened_poisson(points, normals, depth)
    return regularized(surface, SurfaceIndex(surface), np.zeros(len(surface.vertices), dtype=bool))


RECONSTRUCTIONS: dict[str, Callable[[np.ndarray, np.ndarray, int], TriangleMesh]] = {
    "builtin": screened_poisson,
    "pymeshlab": published,
}


def check_available(name: str) -> None:
    """Raises RefMeshError, saying what to do, where the reconstruction needs a package that is not installed."""
    if name == meshlab.PACKAGE:
        meshlab.check_installed()


def build_with(
    name: str, surface: GroupSurface, spacing: float, triangles: int, depth: int, density: CaptureDensity | None = None
) -> ReferenceMesh:
    """`build_reference` by one of RECONSTRUCTIONS, with the features of the surface as edges.

    density : of the capture, where the mesh gets more triangles than requested to be as fine; None where it does not.
    """
    reference = build_reference(surface.points, surface.normals, spacing, triangles, depth, RECONSTRUCTIONS[name])
    reference = with_features(reference, surface)
    return reference if density is None else as_fine_as(density, reference)
