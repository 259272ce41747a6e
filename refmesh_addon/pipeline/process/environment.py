"""The Python that a worker runs in, with the packages that its parent can import."""

from __future__ import annotations

import importlib.util
import os
import sys
from collections.abc import Iterator
from pathlib import Path

from ...core.errors import RefMeshError
from ..session.blender_program import BLENDER, running_blender
from ..session.same_packages import site_flags

PACKAGES = ("numpy", "scipy", "trimesh", "tqdm", "PIL", "xatlas", "constriction", "pymeshlab", "distributed")
PACKAGE_ROOT = Path(__file__).resolve().parents[3]  # the folder that holds refmesh_addon
# Variables that could make the worker's Python import other packages than its parent.
_LEFT_OUT = ("PYTHONHOME", "PYTHONSTARTUP", "PYTHONINSPECT")


def python_command() -> list[str]:
    """The start of a command line for a worker: `python_executable`, with the packages of its own only where this process has them.

    Raises RefMeshError as `python_executable` does.
    """
    return [python_executable(), *site_flags()]


def python_executable() -> str:
    """The Python of the running program: not Blender itself, which `sys.executable` is in some builds.

    Raises RefMeshError when none is found.
    """
    for path in _executables():
        if path.stem.lower().startswith("python") and path.is_file():
            return str(path)
    raise RefMeshError(f"no Python executable found in {sys.prefix}: RefMesh needs the one that comes with Blender; reinstall Blender")


def _executables() -> Iterator[Path]:
    if sys.executable:
        yield Path(sys.executable)
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    for prefix in dict.fromkeys((sys.prefix, sys.exec_prefix, sys.base_prefix)):
        for folder in (Path(prefix) / "bin", Path(prefix)):
            for name in (version, "python3", "python"):
                yield folder / (name + ".exe" if os.name == "nt" else name)


def worker_environment() -> dict[str, str]:
    """The environment variables of a worker: those of this process, changed so that Python imports the same packages."""
    environment = {name: value for name, value in os.environ.items() if name not in _LEFT_OUT}
    folders = [str(PACKAGE_ROOT), *package_folders()]
    environment["PYTHONPATH"] = os.pathsep.join(dict.fromkeys(folders))
    environment["PYTHONNOUSERSITE"] = "1"
    environment["PYTHONSAFEPATH"] = "1"  # a file numpy.py in the current folder must not be taken for numpy
    environment["PYTHONUTF8"] = "1"
    if running_blender():
        environment.setdefault(BLENDER, running_blender())
    return environment


def package_folders() -> list[str]:
    """Folders to import PACKAGES from, in the order of `sys.path`, without importing them."""
    folders = {folder for name in PACKAGES for folder in _folders_of(name)}
    on_path = [folder for folder in sys.path if folder in folders]
    return on_path + sorted(folders.difference(on_path))


def _folders_of(name: str) -> list[str]:
    try:
        spec = importlib.util.find_spec(name)
    except ValueError:  # imported in a way that left no spec
        return []
    if spec is None or spec.origin is None:
        return []
    if spec.submodule_search_locations is None:  # a single file
        return [str(Path(spec.origin).parent)]
    return [str(Path(folder).parent) for folder in spec.submodule_search_locations]
