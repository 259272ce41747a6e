"""Frames of the synthetic sequences as files, written once: `python -m benchmarks.frames NAME COUNT` prints their folder."""

from __future__ import annotations

import argparse
import hashlib
from pathlib import Path

from refmesh_addon.io.ply import write_ply
from sample_scenes import generators

ROOT = Path(__file__).resolve().parent.parent
CACHE = ROOT / "build" / "benchmarks"
KEY_LENGTH = 12


def frames_folder(name: str, count: int, cache: Path = CACHE) -> Path:
    """The folder with `count` frames of a synthetic sequence, NAME_0001.ply on, at equal steps of time from 0 to 1.

    They are written where there are none yet, or where the code that makes them has changed since.
    """
    folder = cache / f"{name}-{count}-{_generators_key()}"
    if len(list(folder.glob("*.ply"))) < count:
        folder.mkdir(parents=True, exist_ok=True)
        for number, mesh in enumerate(generators.SEQUENCES[name]().frames(count), 1):
            write_ply(folder / f"{name}_{number:04d}.ply", mesh)
    return folder


def one_camera_folder(name: str, count: int, cache: Path = CACHE) -> Path:
    """The same frames as one virtual depth camera sees them."""
    folder = cache / f"{name}-one-camera-{count}-{_generators_key()}"
    if len(list(folder.glob("*.ply"))) < count:
        folder.mkdir(parents=True, exist_ok=True)
        sequence = generators.SEQUENCES[name]()
        camera = generators.camera_before(sequence)
        for number, mesh in enumerate(sequence.frames(count), 1):
            write_ply(folder / f"{name}_{number:04d}.ply", camera.seen(mesh, number))
    return folder


def _generators_key() -> str:
    sources = sorted(Path(generators.__file__).parent.glob("*.py"))
    return hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()[:KEY_LENGTH]


def main() -> None:
    """Writes the frames and prints their folder."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("name", choices=generators.SEQUENCES)
    parser.add_argument("count", type=int)
    parser.add_argument("--cache", type=Path, default=CACHE, help="folder for generated frames")
    arguments = parser.parse_args()
    print(frames_folder(arguments.name, arguments.count, arguments.cache))


if __name__ == "__main__":
    main()
