"""The second half of tracking, where requested: rounds of global optimization over the whole sequence."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from scipy import sparse

from ...core.geometry.rotations import rigid_motions
from ...core.tracking import lloyd
from ...core.tracking.coarse_samples import coarse_samples
from ...core.tracking.global_optimization import optimize
from ...core.tracking.ownership import Ownership
from ...core.tracking.volume import VolumeSamples
from ...core.types import FrozenArrays
from ..session.cache import digest
from ..session.context import Context
from ..session.job import TRACKING
from ..session.stage_share import StageShare
from .tracking import FORWARD_SHARE, volume_of
from .tracking_result import TrackingResult

GLOBAL_SCHEMA = 2


@dataclass(frozen=True)
class GlobalRound(FrozenArrays):
    """positions : (F, C, 3) after the round.  energies : of the start and after each iteration.  affinity : (C, C) weights."""

    positions: Annotated[np.ndarray, "(F, C, 3) float64"]
    energies: Annotated[np.ndarray, "(N) float64"]
    affinity: sparse.csr_matrix


@dataclass(frozen=True)
class FrameEnergies(FrozenArrays):
    """Figures per frame as forward tracking has them, (F,) each; see `TrackedFrames`."""

    dfu: Annotated[np.ndarray, "(F) float64"]
    lloyd_energy: Annotated[np.ndarray, "(F) float64"]
    arap_energy: Annotated[np.ndarray, "(F) float64"]


def optimize_globally(context: Context, forward: TrackingResult) -> TrackingResult:
    """The tracking after as many rounds as the settings ask for; without rounds it stays the same."""
    result, energies = forward, []
    if forward.changes and context.settings.tracking.global_rounds:
        context.warn("--global-rounds is left out: centers are born or retired in this take, which global optimization does not support")
        return forward
    for index in range(context.settings.tracking.global_rounds):
        result, falling = _after_round(context, result, index)
        energies.append(falling.tolist())
    if energies:
        _report(context, result)
        context.report.tracking["centers_dropped"] = forward.positions.shape[1] - result.positions.shape[1]
        context.report.tracking["global_energies"] = energies
    return result


def _after_round(context: Context, last: TrackingResult, index: int) -> tuple[TrackingResult, np.ndarray]:
    """The tracking after one more round, and the energies on the way; a run that was killed goes on after the last one."""
    (whole,) = last.ranges
    key = digest(GLOBAL_SCHEMA, whole.key, index)
    done = context.cache.load_or_make_result(f"tracking/global_{index:02d}", key, GlobalRound, lambda: _optimized(context, last, index))
    StageShare(TRACKING, FORWARD_SHARE).skip(context.notify, (index + 1) / context.settings.tracking.global_rounds)
    following = replace(whole, load_affinity=lambda: done.affinity, key=key)
    return replace(last, positions=done.positions, ranges=(following,)), done.energies


def _optimized(context: Context, last: TrackingResult, index: int) -> GlobalRound:
    settings, done, (whole,) = context.settings.tracking, 0.0, last.ranges
    rounds = StageShare(TRACKING, FORWARD_SHARE)

    def progress(share: float) -> None:
        nonlocal done
        done = share
        rounds.tell(context.notify, (index + share) / settings.global_rounds)

    def samples_of(frame: int) -> VolumeSamples:
        progress(done)  # so that a run over many frames soon hears that it was cancelled
        return _samples(context, frame)

    optimized = optimize(last.positions, whole.load_affinity(), samples_of, whole.spacing, settings.affinity, progress)
    return GlobalRound(optimized.positions, optimized.energies, optimized.affinity.weights())


def _samples(context: Context, frame: int) -> VolumeSamples:
    """From disk each time: the samples of a long take would not fit the memory."""
    settings = context.settings.tracking
    key = digest(GLOBAL_SCHEMA, context.frames.keys[frame], settings.resolution, settings.centers)
    entry = f"tracking/samples_{context.numbers[frame]:04d}"
    make = lambda: coarse_samples(volume_of(context, frame), settings.centers)
    return context.cache.load_or_make_result(entry, key, VolumeSamples, make)


def _report(context: Context, optimized: TrackingResult) -> None:
    """Figures on the finest samples; the evenness of forward tracking stays as `dfu_forward`."""
    key = digest(GLOBAL_SCHEMA, optimized.ranges[0].key)
    make = lambda: _energies(context, optimized)
    energies = context.cache.load_or_make_result("tracking/global_figures", key, FrameEnergies, make)
    report = context.report.tracking
    report["dfu_forward"] = report["dfu"]
    report.update({name: values.tolist() for name, values in vars(energies).items()})


def _energies(context: Context, optimized: TrackingResult) -> FrameEnergies:
    rows, before, (whole,) = [], optimized.positions[0], optimized.ranges
    affinity, unit = whole.load_affinity(), whole.spacing**2
    for frame, centers in enumerate(optimized.positions):
        context.notify(TRACKING, context.numbers[frame], 1.0)
        cells = lloyd.cells(centers, Ownership(volume_of(context, frame).finest))
        apart = rigid_motions(affinity, before, centers).apply(before) - centers
        rows.append((cells.non_uniformity, cells.energy / unit, np.einsum("ni,ni->n", apart, apart).mean() / unit))
        before = centers
    return FrameEnergies(*np.array(rows).T)
