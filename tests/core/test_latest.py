"""One thing per process: built once for equal inputs, gone before the next is built."""

import gc
import weakref
from dataclasses import dataclass

import numpy as np

from refmesh_addon.core.deformation.arap import ArapSolver
from refmesh_addon.core.latest import latest_only
from refmesh_addon.core.types import Keyed

from .shapes import ball


@dataclass(frozen=True, eq=False)
class Shared(Keyed):
    key: str
    value: int


class Thing:
    def __init__(self, value):
        self.value = value


def test_equal_inputs_are_built_once_and_others_after_the_last_is_gone():
    built = []

    def build(shared):
        assert all(thing() is None for thing in built)
        thing = Thing(shared.value)
        built.append(weakref.ref(thing))
        return thing

    one, other = latest_only(build), latest_only(lambda shared: build(shared))
    assert [one(Shared("a", 1)).value, one(Shared("a", 2)).value, one(Shared("b", 3)).value] == [1, 1, 3]
    assert (other(Shared("b", 4)).value, one(Shared("b", 5)).value) == (4, 5)
    assert len(built) == 4


def test_a_solver_is_released_without_the_garbage_collector():
    """Factors are large, and the collector counts objects, not bytes."""
    mesh = ball(2)
    gc.disable()
    try:
        solver = ArapSolver(mesh)
        solver.deform(np.array([0]), mesh.vertices[:1] + 1, mesh.vertices)
        parts = [weakref.ref(part) for part in (solver, solver.energy, solver._latest[1])]
        del solver
        assert [part() for part in parts] == [None, None, None]
    finally:
        gc.enable()
