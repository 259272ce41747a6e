"""The examples in docstrings of the core run and print what they say."""

import doctest
import importlib
from pathlib import Path

import numpy as np
import pytest

from refmesh_addon.core.settings import TrackingSettings
from refmesh_addon.core.tracking.forward import first_frame
from refmesh_addon.core.tracking.volume import sample_volume
from refmesh_addon.core.types import TriangleMesh

from ..core import shapes

ROOT = Path(__file__).resolve().parents[2]
MODULES = [path for path in sorted((ROOT / "refmesh_addon" / "core").rglob("*.py")) if ">>> " in path.read_text()]
# What a user of the core calls first, from a notebook say.
ENTRY_POINTS = {"sample_volume", "first_frame", "next_frame", "content_groups", "reference_centers", "FrameMap", "align"}
ENTRY_POINTS |= {"ArapSolver", "fit_surface", "surface_distance", "SurfaceIndex", "HalfEdges", "to_arrays"}


@pytest.fixture(scope="module")
def known() -> dict:
    """Names that every example may use beside those of its module: a closed mesh, and centers spread through it."""
    ball, settings = shapes.ball(3), TrackingSettings(centers=50, resolution=32)
    tracked = first_frame(sample_volume(ball, settings.resolution, settings.centers), settings)
    return {"np": np, "TriangleMesh": TriangleMesh, "sample_volume": sample_volume, "ball": ball, "tracked": tracked}


def examples(path: Path, known: dict) -> list[doctest.DocTest]:
    module = importlib.import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))
    return [test for test in doctest.DocTestFinder().find(module, extraglobs=known) if test.examples]


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT / "refmesh_addon" / "core")))
def test_examples_print_what_they_say(path, known):
    tests = examples(path, known)
    assert tests
    for test in tests:
        outcome = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(test)
        assert not outcome.failed, test.name


def test_what_is_called_from_notebooks_has_an_example():
    assert ENTRY_POINTS <= {test.name.split(".")[-1] for path in MODULES for test in examples(path, {})}
