"""The second half of tracking, where it is asked for: rounds of global optimisation over the whole sequence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import sparse

from ...core.geometry.rotations import rigid_motions
from ...core.tracking import lloyd
from ...core.tracking.coarse_samples import coarse_samples
from ...core.tracking.global_optimization import optimize
from ...core.tracking.ownership import Ownership
from ...core.tracking.volume import VolumeSamples
from ..session.cache import Arrays, digest
from ..session.context import Context
from .tracking import FORWARD_SHARE, volume_of
from .tracking_result import Tracked

GLOBAL_SCHEMA = 1


def optimize_globally(context: Context, tracked: Tracked) -> Tracked:
    """The tracking after as many rounds as the settings ask for; without rounds it stays the same."""
    found, energies = tracked, []
    for index in range(context.settings.tracking.global_rounds):
        found, falling = _after_round(context, found, index)
        energies.append([float(energy) for energy in falling])
    if energies:
        _report(context, found)
        context.report.tracking["centers_dropped"] = tracked.positions.shape[1] - found.positions.shape[1]
        context.report.tracking["global_energies"] = energies
    return found


def _after_round(context: Context, last: Tracked, index: int) -> tuple[Tracked, np.ndarray]:
    """The tracking after one more round, and the energies on the way; a run that was killed goes on after the last one."""
    (part,) = last.parts
    key = digest(GLOBAL_SCHEMA, part.key, index)
    made = context.cache.load_or_make(f"tracking/global_{index:02d}", key, lambda: _optimized(context, last, index))
    weights = sparse.csr_matrix((made["value"], (made["row"], made["column"])), (made["positions"].shape[1],) * 2)
    return replace(last, positions=made["positions"], parts=(replace(part, affinity=weights, key=key),)), made["energies"]


def _optimized(context: Context, last: Tracked, index: int) -> Arrays:
    settings, done, (part,) = context.settings.tracking, 0.0, last.parts

    def progress(share: float) -> None:
        nonlocal done
        done = share
        total = (index + share) / settings.global_rounds
        context.notify("tracking", None, FORWARD_SHARE + (1 - FORWARD_SHARE) * total)

    def samples_of(frame: int) -> VolumeSamples:
        progress(done)  # so that a run over many frames hears soon that nobody wants it any more
        return _samples(context, frame)

    found = optimize(last.positions, part.affinity, samples_of, part.spacing, settings.affinity, progress)
    pairs = found.affinity.weights().tocoo()
    return {"positions": found.positions, "energies": found.energies, "row": pairs.row, "column": pairs.col, "value": pairs.data}


def _samples(context: Context, frame: int) -> VolumeSamples:
    """From disk each time: the samples of a long take would not fit the memory."""
    settings = context.settings.tracking
    key = digest(GLOBAL_SCHEMA, context.frames.keys[frame], settings.resolution, settings.centers)

    def make() -> Arrays:
        samples = coarse_samples(volume_of(context, frame), settings.centers)
        return {"positions": samples.positions, "masses": samples.masses, "spacing": np.float64(samples.spacing)}

    made = context.cache.load_or_make(f"tracking/samples_{context.numbers[frame]:04d}", key, make)
    return VolumeSamples(made["positions"], made["masses"], float(made["spacing"]))


def _report(context: Context, found: Tracked) -> None:
    """Figures per frame as forward tracking has them, on the finest samples; its own evenness stays as `dfu_forward`."""
    key = digest(GLOBAL_SCHEMA, found.parts[0].key)
    made = context.cache.load_or_make("tracking/global_figures", key, lambda: _figures(context, found))
    report = context.report.tracking
    report["dfu_forward"] = report["dfu"]
    report.update({name: values.tolist() for name, values in made.items()})


def _figures(context: Context, found: Tracked) -> Arrays:
    figures: dict[str, list[float]] = {"dfu": [], "lloyd_energy": [], "arap_energy": []}
    before, (part,) = found.positions[0], found.parts
    for frame, centers in enumerate(found.positions):
        context.notify("tracking", context.numbers[frame], 1.0)
        cells = lloyd.cells(centers, Ownership(volume_of(context, frame).finest))
        apart = rigid_motions(part.affinity, before, centers).apply(before) - centers
        figures["dfu"].append(cells.non_uniformity)
        figures["lloyd_energy"].append(cells.energy / part.spacing**2)
        figures["arap_energy"].append(np.einsum("ni,ni->n", apart, apart).mean() / part.spacing**2)
        before = centers
    return {name: np.array(values) for name, values in figures.items()}
