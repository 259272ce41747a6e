"""How many triangles a reference mesh gets, and how many points its reconstruction needs for them."""

from __future__ import annotations

import numpy as np

# Fewest triangles where no number is requested and the surface is curved: a coarse capture spends its few where its surface curves, in each
# frame elsewhere, and a mesh that has to fit all frames cannot. Its fit of a ball stays rippled with a sixth of these; two thirds of them
# miss a body captured with 4,000 triangles by 0.016 % of its diagonal in the mean, these by 0.013 %.
MIN_TRIANGLES = 30_000
# Most triangles where no number is requested. The factors of a mesh grow faster than the mesh, and every worker process holds those of
# one group. The fit pulls all of them onto the whole surface of each frame; finer detail of a capture is left to its textures.
MAX_TRIANGLES = 150_000
# Frames of more triangles are dense: they are aligned by a copy with about ALIGNED_VERTICES, as many as the largest reference mesh has, and
# only the last round of the fit looks at all of their surface.
DENSE_TRIANGLES, ALIGNED_VERTICES = 300_000, 75_000
POINTS_PER_TRIANGLE = 6.0  # reconstruction points of a whole group for each triangle of the budget
MIN_POINTS = 6000  # of a whole group, however few triangles: enough for the coarsest reconstruction


def triangle_budget(requested: int, captured: list[int], needed: list[int], sides: int = 1) -> int:
    """Triangles of a reference mesh: as requested, or for 0 the median of those of its frames, from MIN_TRIANGLES to MAX_TRIANGLES.

    needed : triangles that the shape of each frame needs, as `needed_triangles` gives them. Where MIN_TRIANGLES are more than that,
    as on bodies with flat faces, these are enough.
    sides : 2 for a layer, which has each part of the surface twice; MIN_TRIANGLES count for one of them.
    """
    return requested or min(max(int(np.median(captured)), min(sides * MIN_TRIANGLES, int(np.median(needed)))), MAX_TRIANGLES)


def is_capped(requested: int, captured: list[int]) -> bool:
    """Whether a reference mesh gets fewer triangles than its frames have because nobody asked for more."""
    return not requested and float(np.median(captured)) > MAX_TRIANGLES


def points_per_frame(triangles: int, frames: int) -> int:
    """Points that each frame of a group contributes to its reconstruction. triangles : the budget."""
    return int(np.ceil(max(POINTS_PER_TRIANGLE * triangles, MIN_POINTS) / frames))
