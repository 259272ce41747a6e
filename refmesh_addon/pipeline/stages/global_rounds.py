"""The second half of tracking, where requested: rounds of global optimization over the whole sequence."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from scipy import sparse

from ...core.geometry.rotations import rigid_motions
from ...core.tracking import lloyd
from ...core.tracking.coarse_samples import coarse_samples
from ...core.tracking.global_optimization import Optimized, Trajectories, optimize
from ...core.tracking.ownership import Ownership
from ...core.tracking.volume import VolumeSamples
from ...core.types import FrozenArrays
from ..session.cache import digest
from ..session.context import Context
from ..session.job import TRACKING
from ..session.stage_share import StageShare
from .groups import divided
from .tracking import FORWARD_SHARE, requested_rounds, volume_of
from .tracking_result import TrackingResult

GLOBAL_SCHEMA = 3
VIEWS_STAY = (
    "--global-rounds is left out: it spreads centers evenly through the volume of every frame, but in an open take this ends where the "
    "view does, so they would slide over the body; leave the option out"
)


@dataclass(frozen=True)
class GlobalRound(FrozenArrays):
    """positions : (F, C, 3) after the round.  kept : (C,) indices of the centers before it that they are.
    active : (F, C) bool, which centers there are; None where all are there in all frames.
    energies : of the start and after each iteration.  affinity : (C, C) weights.
    """

    positions: Annotated[np.ndarray, "(F, C, 3) float64"]
    kept: Annotated[np.ndarray, "(C) integer"]
    energies: Annotated[np.ndarray, "(N) float64"]
    affinity: sparse.csr_matrix
    active: Annotated[np.ndarray, "(F, C) bool"] | None = None


@dataclass(frozen=True)
class FrameEnergies(FrozenArrays):
    """Figures per frame as forward tracking has them, (F,) each; see `TrackedFrames`."""

    dfu: Annotated[np.ndarray, "(F) float64"]
    lloyd_energy: Annotated[np.ndarray, "(F) float64"]
    arap_energy: Annotated[np.ndarray, "(F) float64"]


def optimize_globally(context: Context, forward: TrackingResult) -> TrackingResult:
    """The tracking after as many rounds as the settings ask for; without rounds it stays the same, and so does that of open takes.

    Where centers are born or retired, the frames between two such changes are optimized together.
    """
    result, energies, rounds = forward, [], requested_rounds(context)
    if rounds < context.settings.tracking.global_rounds:
        context.warn(VIEWS_STAY)
    for index in range(rounds):
        result, falling = _after_round(context, result, index)
        energies.append(falling.tolist())
    if energies:
        _report(context, result)
        context.report.tracking["centers_dropped"] = _ever_there(forward) - _ever_there(result)
        context.report.tracking["global_energies"] = energies
    return result


def _ever_there(tracking: TrackingResult) -> int:
    return tracking.positions.shape[1] if tracking.active is None else int(tracking.active.any(axis=0).sum())


def _after_round(context: Context, last: TrackingResult, index: int) -> tuple[TrackingResult, np.ndarray]:
    """The tracking after one more round, and the energies on the way; a run that was killed goes on after the last one."""
    (whole,) = last.ranges
    key = digest(GLOBAL_SCHEMA, whole.key, index)
    done = context.cache.load_or_make_result(f"tracking/global_{index:02d}", key, GlobalRound, lambda: _optimized(context, last, index))
    StageShare(TRACKING, FORWARD_SHARE).skip(context.notify, (index + 1) / context.settings.tracking.global_rounds)
    following = replace(whole, load_affinity=lambda: done.affinity, key=key)
    moving = None if last.moving is None else last.moving[done.kept]
    return replace(last, positions=done.positions, ranges=(following,), active=done.active, moving=moving), done.energies


def _optimized(context: Context, last: TrackingResult, index: int) -> GlobalRound:
    rounds, (whole,) = context.settings.tracking.global_rounds, last.ranges
    runs = divided([tuple(range(len(last.positions)))], last.changes)
    share = lambda part: StageShare(TRACKING, FORWARD_SHARE).part((index + part) / rounds, (index + part + 1 / len(runs)) / rounds)
    parts = [_optimized_run(context, last, run, share(number / len(runs))) for number, run in enumerate(runs)]
    if last.active is None:
        (done,) = parts
        return GlobalRound(done.positions, done.kept, done.energies, done.affinity.weights())
    positions, active = last.positions.copy(), np.zeros_like(last.active)
    for run, done in zip(runs, parts, strict=True):
        kept = last.members(run)[done.kept]
        positions[np.ix_(run, kept)], active[np.ix_(run, kept)] = done.positions, True
    # Affinities of the whole take stay those of forward tracking: no run alone knows what others show apart.
    everyone = np.arange(positions.shape[1])
    return GlobalRound(positions, everyone, _total(runs, [done.energies for done in parts]), whole.load_affinity(), active)


def _optimized_run(context: Context, last: TrackingResult, run: tuple[int, ...], share: StageShare) -> Optimized:
    """The members of successive frames, optimized in these."""
    done, members, (whole,) = 0.0, last.members(run), last.ranges

    def progress(part: float) -> None:
        nonlocal done
        done = part
        share.tell(context.notify, part)

    def samples_of(row: int) -> VolumeSamples:
        progress(done)  # so that a run over many frames soon hears that it was canceled
        return _samples(context, run[row])

    moving = None if last.moving is None else last.moving[members]
    tracks = Trajectories(last.centers_in(run), last.affinity_at(run), whole.spacing, moving)
    return optimize(tracks, samples_of, context.settings.tracking.affinity, progress)


def _total(runs: list[tuple[int, ...]], energies: list[np.ndarray]) -> np.ndarray:
    """(N,) mean energy of all frames; runs that end sooner keep their last.  energies : of each run."""
    count = max(map(len, energies))
    padded = [np.pad(own, (0, count - len(own)), mode="edge") for own in energies]
    return np.average(padded, axis=0, weights=[len(run) for run in runs])


def _samples(context: Context, frame: int) -> VolumeSamples:
    """From disk each time: the samples of a long take would not fit in memory."""
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
    rows, before, (whole,) = [], (), optimized.ranges
    for frame in range(len(optimized.positions)):
        context.notify(TRACKING, context.numbers[frame], 1.0)
        centers, members = optimized.positions[frame], optimized.members((frame,))
        cells = lloyd.cells(centers[members], Ownership(volume_of(context, frame).finest))
        last = optimized.positions[frame - 1] if np.array_equal(members, before) else centers
        apart = rigid_motions(optimized.affinity_at((frame,)), last[members], centers[members]).apply(last[members]) - centers[members]
        rows.append((cells.non_uniformity, cells.energy / whole.spacing**2, np.einsum("ni,ni->n", apart, apart).mean() / whole.spacing**2))
        before = members
    return FrameEnergies(*np.array(rows).T)
