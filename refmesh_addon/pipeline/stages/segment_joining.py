"""Short runs of an open take joined with their neighbors: what a camera sees changes, but a few frames are no run to work with.

Runs are cut where the view changes and where a mesh does not serve, each by itself. So there may be two short ones side by side that
one mesh would serve as well. A mesh for both is tried on the frames that each serves worst, and kept if it passes none of the limits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...core.evaluation.segment_limits import USUAL, FrameFigures, excess, passed_limits
from .segment_trials import Run
from .segments import LONGEST_VIEW, Cuts

SHORT = 10  # frames below which a run is short: a third of a second
WORST = 2  # frames of a run that a mesh for more has to serve

Figures = Mapping[int, FrameFigures]  # by index of the frame


@dataclass(frozen=True)
class _Piece:
    """A run, what its mesh is made from, why it begins, and how well it serves some of its frames."""

    frames: Run
    source: tuple[int, int]
    reason: str
    figures: Figures

    @property
    def alone(self) -> bool:
        """Whether its mesh is made from all its frames and no others."""
        return self.source == (self.frames[0], self.frames[-1] + 1)

    def with_next(self, following: _Piece) -> _Piece:
        figures = {**self.figures, **following.figures}
        return _Piece(self.frames + following.frames, (self.source[0], following.source[1]), self.reason, figures)


def worst_figures(figures: Figures, run: Run) -> Figures:
    """Those of the frames of a run that its mesh serves worst."""
    worst = sorted(run, key=lambda frame: -excess(figures[frame], USUAL))[:WORST]
    return {frame: figures[frame] for frame in sorted(worst)}


def with_short_joined(
    cuts: Cuts, figures: Sequence[Figures], tried: Callable[..., Mapping[int, FrameFigures]], fixed: Sequence[int]
) -> Cuts:
    """The cuts without those beside a short run that a mesh for both sides makes needless.

    figures : of each run, of some of its frames.  tried : gives those of some frames with a mesh for a run, `SegmentTrials.own_figures`.
    fixed : frames at which a run begins in any case.
    """
    stop = int(cuts.sources.max())
    runs = zip(cuts.runs(stop), cuts.sources.tolist(), cuts.reasons, figures, strict=True)
    pieces = [_Piece(run, (source[0], source[1]), reason, own) for run, source, reason, own in runs]
    joined = pieces[:1]
    for piece in pieces[1:]:
        both = joined[-1].with_next(piece)
        short = min(len(joined[-1].frames), len(piece.frames)) < SHORT and len(both.frames) <= LONGEST_VIEW
        if short and joined[-1].alone and piece.alone and piece.frames[0] not in fixed and _serves(both, tried):
            joined[-1] = both
        else:
            joined.append(piece)
    rows = [(piece.frames[0], piece.reason, piece.source) for piece in joined]
    starts, reasons, sources = zip(*rows, strict=True)
    return replace(cuts, starts=np.array(starts), reasons=reasons, sources=np.array(sources))


def _serves(piece: _Piece, tried: Callable[..., Mapping[int, FrameFigures]]) -> bool:
    theirs = tried(piece.frames, *piece.figures)
    return not any(passed_limits(theirs[frame], own) for frame, own in piece.figures.items())
