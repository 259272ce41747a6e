"""The packages that the work needs: whether they are installed, recent enough, and can be imported.

Blender unpacks the wheels of all extensions into one folder, where the highest version of a package wins, and it checks
neither the system libraries nor the platform that a wheel was built for. So a package can be missing, outdated or broken.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Iterable
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path

from ...core.errors import RefMeshError
from .environment import python_command, worker_environment

# Package -> lowest version that the code was run with, and what does not work without it.
NEEDED = {
    "numpy": ("1.26", "nothing works"),
    "scipy": ("1.15", "tracking, reference meshes and deformation do not work"),
    "trimesh": ("4.5", "files other than OBJ cannot be read"),
    "PIL": ("10.0", "pictures (Pillow), and with them the textures of a capture, are not read"),
    "xatlas": ("0.0.9", "texture layouts have more seams"),
    "constriction": ("0.4", "compressed .refmesh files are neither written nor read"),
    "tqdm": ("4.60", "jobs in background mode do not work"),
}
ESSENTIAL = ("numpy", "scipy", "trimesh", "tqdm")  # without one of these no job runs
# Family of Linux distributions -> the command that installs packages, and what it calls them; "" for one that it does not have.
INSTALLERS = {
    "debian": ("sudo apt install", "python3-{}", {"PIL": "pil", "xatlas": "", "constriction": ""}),
    "fedora": ("sudo dnf install", "python3-{}", {"PIL": "pillow", "trimesh": "", "xatlas": "", "constriction": ""}),
    "arch": ("sudo pacman -S", "python-{}", {"PIL": "pillow", "trimesh": "", "xatlas": "", "constriction": ""}),
}
OS_RELEASE = Path("/etc/os-release")
TIME_LIMIT = 60.0  # seconds for one import; all of them take one or two
_PROBE = """
import importlib, json, sys
try:
    outcome = getattr(importlib.import_module(sys.argv[1]), "__version__", ""), ""
except Exception as error:
    while error.__cause__ or error.__context__:  # scipy hides the reason behind a remark of its own
        error = error.__cause__ or error.__context__
    outcome = "", " ".join(f"{type(error).__name__}: {error}".split())
print(json.dumps(outcome))
"""


def missing_packages() -> tuple[str, ...]:
    """A line for each package that is not installed."""
    return tuple(f"Python package '{name}' is missing: {NEEDED[name][1]}" for name in missing_names())


@lru_cache(maxsize=1)
def missing_names() -> tuple[str, ...]:
    """Names of the packages of NEEDED that are not installed, looked up without loading any, so that a panel may draw them."""
    return tuple(name for name in NEEDED if find_spec(name) is None)


def how_to_install(names: Iterable[str], system: str | None = None) -> str:
    """What a person can do about packages that are missing, with the command of their Linux distribution where it is known.

    system : text of os-release; None reads that of this machine, "" for a Python that no distribution brought.
    """
    if system is None:
        system = OS_RELEASE.read_text(encoding="utf-8") if sys.prefix == "/usr" and OS_RELEASE.is_file() else ""
    family = next((family for family in INSTALLERS if re.search(rf'^ID(_LIKE)?="?.*\b{family}\b', system, flags=re.MULTILINE)), None)
    if family is None:
        return "Install the RefMesh zip for this system: it brings them. The zip 'no-wheels' is for the Blender of a Linux distribution"
    command, pattern, names_there = INSTALLERS[family]
    packages = {name: names_there.get(name, name) for name in names}
    there = [pattern.format(package) for package in packages.values() if package]
    elsewhere = [{"PIL": "pillow"}.get(name, name) for name, package in packages.items() if not package]
    parts = [f"in a terminal, '{command} {' '.join(there)}'"] if there else []
    parts += [f"with pip, '{' '.join(elsewhere)}', which the distribution does not have"] if elsewhere else []
    return f"To get them: {'; '.join(parts)}. Then start Blender again"


def check_packages() -> tuple[dict[str, str], list[str]]:
    """Package -> version of each that works, and a line for each that does not, in the Python that workers run in.

    Raises RefMeshError when that Python itself cannot be run.
    """
    imports = {name: _imported(name) for name in NEEDED}
    problems = [_problem(name, *imports[name]) for name in NEEDED]
    versions = {name: version for name, (version, error) in imports.items() if not error}
    return versions, [problem for problem in problems if problem]


def _imported(name: str) -> tuple[str, str]:
    """Version and error of one package, each "" where there is none; in a process of its own, since a broken one may crash it."""
    command = [*python_command(), "-c", _PROBE, name]
    try:
        done = subprocess.run(command, env=worker_environment(), capture_output=True, text=True, timeout=TIME_LIMIT)
    except subprocess.TimeoutExpired:
        return "", f"still loading after {TIME_LIMIT:.0f} seconds"
    except OSError as error:
        raise RefMeshError(f"{command[0]} cannot be run ({error}): RefMesh needs it for its work; reinstall Blender") from error
    lines = done.stdout.strip().splitlines()
    return tuple(json.loads(lines[-1])) if done.returncode == 0 and lines else ("", f"Python ended with exit code {done.returncode}")


def import_problem(error: ImportError) -> str:
    """The message for the user when an import failed in the middle of the work."""
    package = (error.name or "").partition(".")[0]
    if isinstance(error, ModuleNotFoundError) and package in NEEDED:
        return f"the Python package '{package}' is missing. {how_to_install([package])}"
    cause = error
    while cause.__cause__ or cause.__context__:  # scipy hides the reason behind a remark of its own
        cause = cause.__cause__ or cause.__context__
    detail = " ".join(str(cause).split())
    return f"a Python package cannot be loaded: {detail}"


def _problem(name: str, version: str, error: str) -> str:
    """A line about what is wrong with a package, "" when nothing is."""
    lowest, effect = NEEDED[name]
    if error.startswith("ModuleNotFoundError") and f"'{name}'" in error:
        return f"'{name}' is missing: {effect}"
    if error:
        return f"'{name}' cannot be loaded ({error}): {effect}"
    if version and _numbers(version) < _numbers(lowest):
        return f"'{name}' is version {version}, at least {lowest} is needed: another extension may have brought it; {effect} reliably"
    return ""


def _numbers(version: str) -> tuple[int, ...]:
    """The leading numbers of a version: "2.0.0rc1" is (2, 0)."""
    parts = version.split(".")
    count = next((index for index, part in enumerate(parts) if not part.isdigit()), len(parts))
    return tuple(int(part) for part in parts[:count])
