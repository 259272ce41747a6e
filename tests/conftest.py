"""Fixtures that every test folder may use."""

import atexit
import os
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest

if "REFMESH_MEASUREMENTS" not in os.environ:  # not the user's own
    MEASUREMENTS = tempfile.mkdtemp(prefix="refmesh-")
    atexit.register(shutil.rmtree, MEASUREMENTS, ignore_errors=True)
    os.environ["REFMESH_MEASUREMENTS"] = os.path.join(MEASUREMENTS, "times.json")
ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def shared_data() -> Callable[[str], Path]:
    """shared_data("dancer") is the folder of that real sequence; the test is skipped where it is missing."""

    def folder(name: str) -> Path:
        path = ROOT.parent / "shared" / "data" / name
        if not path.is_dir():
            pytest.skip(f"the real sequence '{name}' is not at {path}")
        return path

    return folder
