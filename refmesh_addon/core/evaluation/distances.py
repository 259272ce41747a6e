"""The figures of an evaluation: distances between two surfaces and their PSNR."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Distances:
    """Distances from one surface to another: mean, root mean square, 99th percentile and maximum.

    All are shares of the source frame's bounding-box diagonal.
    """

    mean: float
    rms: float
    p99: float
    max: float

    @classmethod
    def of(cls, shares: np.ndarray) -> Distances:
        """Figures of (N,) distances, given as shares of the diagonal; all zero for an empty array."""
        shares = shares if len(shares) else np.zeros(1)
        return cls(float(shares.mean()), float(np.sqrt((shares**2).mean())), float(np.percentile(shares, 99)), float(shares.max()))


@dataclass(frozen=True)
class TwoSidedDistance:
    """Distances in both directions and the PSNR, which is that of the worse direction.

    visible_to_source : deformed_to_source without the points that no camera saw, in contacts and over holes of the source.
    unseen : share of the deformed surface that visible_to_source leaves out.
    d1_psnr, d2_psnr : point-to-point and point-to-plane, dB.
    Of open takes only, where visible_to_source is from what the frame shows: kept : share of the captured surface that source distances
    are measured from.  border : both ways between the borders of what was kept and of what is shown; None where there are none.
    """

    source_to_deformed: Distances
    deformed_to_source: Distances
    visible_to_source: Distances
    unseen: float
    d1_psnr: float
    d2_psnr: float
    kept: float | None = None
    border: Distances | None = None
