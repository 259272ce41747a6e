"""Pieces of a capture that are there in a few frames and have nothing to do with the rest: a prop, a hand, debris.

A center would follow such a piece for a moment and then be drawn into another body, and a reference mesh with the piece would show it
in all of its frames. It is left out of the volume that is followed, and shown as captured where the capture shows it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..geometry.graph import connected_components
from .pieces import Pieces, continuing

LASTING = 10  # frames from which on a piece is followed: as many as a group of the method has at most
NOTICEABLE = 0.03  # share of the surface from which a lasting piece gets centers of its own; smaller ones are some twenty centers
MOST_OF_TAKE = 0.5  # share of the frames of a take from which on a piece of a short one is followed


def lineages(frames: Iterable[Pieces]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """For each frame the (K,) number of the lineage of each piece, and the (K,) share of the frame's surface that it has.

    Pieces that continue in each other, split or merge have one lineage.  frames : read one after the other, two in memory.
    """
    before, start, links, shares = None, 0, [np.zeros((0, 2), dtype=int)], []
    for frame in frames:
        if before is not None:
            links.append(continuing(before, frame) + [start - len(before.areas), start])
        shares.append(frame.areas / max(float(frame.areas.sum()), np.finfo(float).tiny))
        before, start = frame, start + len(frame.areas)
    label = connected_components(np.concatenate(links), start)[1]
    return np.split(label, np.cumsum([len(own) for own in shares])[:-1]), shares


@dataclass(frozen=True)
class Visits:
    """What comes and goes, as numbers of pieces, one array for each frame.

    transient : pieces that are there for a short time only.  coming, leaving : lasting ones, in their first frame, where it is not the
    take's, and in their last.
    """

    transient: list[np.ndarray]
    coming: list[np.ndarray]
    leaving: list[np.ndarray]


def visits(frames: Iterable[Pieces]) -> Visits:
    """The pieces of a take that are not there in all of its frames. A transient one lasts neither long nor for most of the take."""
    label, shares = lineages(frames)
    transient = _transient(label, shares)
    coming, leaving = ([own[:0] for own in transient] for _ in range(2))
    for frame in range(1, len(label)):
        for ends, at, other in ((coming, frame, frame - 1), (leaving, frame - 1, frame)):
            changes = ~np.isin(label[at], label[other]) & (shares[at] >= NOTICEABLE)
            ends[at] = np.setdiff1d(np.flatnonzero(changes), transient[at])
            ends[at] = _unless_all(ends[at], len(label[at]) - len(transient[at]))
    return Visits(transient, coming, leaving)


def _transient(label: list[np.ndarray], shares: list[np.ndarray]) -> list[np.ndarray]:
    """For each frame the numbers of its transient pieces.  label, shares : as `lineages` gives them."""
    if len(label) < 2:
        return [own[:0] for own in label]
    lengths = np.bincount(np.concatenate([np.unique(own) for own in label]))
    largest = np.zeros(len(lengths))
    for own, share in zip(label, shares, strict=True):
        np.maximum.at(largest, own, share)
    brief = (lengths < LASTING) & (lengths < MOST_OF_TAKE * len(label))
    brief[np.argmax(lengths * largest)] = False  # the main body, however often it is lost
    return [_unless_all(np.flatnonzero(brief[own]), len(own)) for own in label]


def _unless_all(pieces: np.ndarray, count: int) -> np.ndarray:
    """A frame keeps something that can be followed, whatever it is."""
    return pieces if len(pieces) < count else pieces[:0]
