"""Make .venv from the locked requirements, where it is missing or stale, and the system libraries that bpy and pymeshlab load.

Standard library only, so that any python3 can start it and say what is missing. Usage: python3.11 environment/create.py
"""

from __future__ import annotations

import ctypes
import fcntl
import hashlib
import os
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv"
LOCK = ROOT / "environment" / "requirements.txt"
STAMP = VENV / "made-from"  # written last: a .venv without it, or with another text in it, is created again
PYTHON_VERSION = (3, 11)  # bpy 5.0 has wheels for no other
# What a wheel loads -> the Debian package that has it. bpy needs all but the last, pymeshlab the last and libGL.
# Only drawing with Workbench or EEVEE loads libEGL, but then bpy aborts without it.
LIBRARIES = {
    "libX11.so.6": "libx11-6",
    "libXext.so.6": "libxext6",
    "libSM.so.6": "libsm6",
    "libICE.so.6": "libice6",
    "libXt.so.6": "libxt6",
    "libXrender.so.1": "libxrender1",
    "libXi.so.6": "libxi6",
    "libXfixes.so.3": "libxfixes3",
    "libxkbcommon.so.0": "libxkbcommon0",
    "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1",
    "libgomp.so.1": "libgomp1",
    "libOpenGL.so.0": "libopengl0",
}
# Each in a process of its own, as pymeshlab imported before bpy breaks bpy. Without its libraries pymeshlab loads, but has no filters.
TRIALS = ("import bpy", "import pymeshlab; pymeshlab.MeshSet().generate_surface_reconstruction_screened_poisson")


def main() -> None:
    check_python()
    with LOCK.open() as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # a second `make` waits here and then finds everything there
        install_packages(missing_packages())
        if not is_current():
            create_venv()


def check_python() -> None:
    if sys.version_info[:2] != PYTHON_VERSION:
        stop(
            "RefMesh needs Python 3.11, the only one that bpy 5.0 runs on; {} is {}.{}. Name one: make PYTHON=/path/to/python3.11".format(
                sys.executable, *sys.version_info[:2]
            )
        )


def missing_packages() -> list[str]:
    """Debian packages of what this machine lacks."""
    packages = [] if find_spec("ensurepip") else ["python3-venv"]
    if sys.platform == "linux":
        packages += [package for library, package in LIBRARIES.items() if not can_load(library)]
    return packages


def can_load(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def install_packages(packages: list[str]) -> None:
    """Install them as root with apt-get; otherwise stop with the line to paste."""
    if not packages:
        return
    update, install = ["apt-get", "update"], ["apt-get", "install", "-y", "--no-install-recommends", *packages]
    if os.geteuid() != 0 or not shutil.which("apt-get"):
        stop(f"system libraries are missing; on Debian: sudo {' '.join(update)} && sudo {' '.join(install)}")
    print("installing system libraries:", *packages, flush=True)
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    for command in (update, install):
        run([command[0], "-q", *command[1:]], env=environment)
    if missing_packages():
        stop(f"still missing after apt-get install: {' '.join(missing_packages())}")


def fingerprint() -> str:
    return f"{hashlib.sha256(LOCK.read_bytes()).hexdigest()} {VENV} {sys.version.split()[0]}\n"


def is_current() -> bool:
    return STAMP.is_file() and STAMP.read_text() == fingerprint() and (VENV / "bin" / "python").exists()


def create_venv() -> None:
    print(f"making {VENV} (about 400 MB to fetch, 1.5 GB on disk)", flush=True)
    if VENV.exists():
        shutil.rmtree(VENV)
    run([sys.executable, "-m", "venv", str(VENV)])
    python = str(VENV / "bin" / "python")
    # Wheels only: nothing here may need a compiler.
    options = ["--quiet", "--disable-pip-version-check", "--no-input", "--require-hashes", "--only-binary", ":all:"]
    run([python, "-m", "pip", "install", *options, "-r", str(LOCK)])
    for trial in TRIALS:
        run([python, "-c", trial])
    STAMP.write_text(fingerprint())


def run(command: list[str], **options) -> None:
    if subprocess.run(command, **options).returncode != 0:
        stop(f"this command failed, see above; mend that and run make again: {' '.join(command)}")


def stop(message: str) -> None:
    sys.exit(f"environment/create.py: {message}")


if __name__ == "__main__":
    main()
