"""Build the extension's zips with Blender's own tool: python extension/build.py [--output FOLDER] [TARGET ...]

A target is a platform as Blender names it, or "no-wheels". Wheels of the locked versions go to wheels/, unmodified as the
index has them, the zips to build/. The same sources give the same bytes. With WITH_PYMESHLAB=1 in the environment the zips
hold PyMeshLab as well and have it in their names.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tomllib
import zipfile
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WHEELS = ROOT / "wheels"
BUILD = ROOT / "build"
PYTHONS = {"3.11": "wheels-cp311.txt", "3.13": "wheels-cp313.txt"}  # Blender 4.2 to 5.0, and from 5.1 on
PYMESHLAB = "pymeshlab.txt"  # the same for every Python
# Blender's name -> the tags that pip may take wheels of, the preferred first. Each is matched as it stands, so all that occur are listed.
PLATFORMS = {
    "linux-x64": ["manylinux2014_x86_64", "manylinux_2_27_x86_64", "manylinux_2_28_x86_64", "manylinux_2_35_x86_64"],
    "windows-x64": ["win_amd64"],
    "macos-arm64": ["macosx_11_0_arm64", "macosx_12_0_arm64"],
    "macos-x64": ["macosx_10_12_x86_64", "macosx_10_13_x86_64", "macosx_10_14_x86_64", "macosx_11_0_x86_64"],
}
# For a Blender of a Linux distribution, on a Python that the wheels are not for: the packages come from the distribution.
NO_WHEELS = "no-wheels"
ZIP_TIME = 1_577_836_800  # 2020-01-01: files in the zip carry this time, not that of their checkout
MEGABYTE = 1e6


def main() -> None:
    """Build what the command line asks for, everything by default, and print the sizes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    targets = [*PLATFORMS, NO_WHEELS]
    parser.add_argument("targets", nargs="*", metavar="TARGET", help=f"one of {', '.join(targets)}; all of them by default")
    parser.add_argument("--output", type=Path, default=BUILD, metavar="FOLDER", help="where the zips go (default: build)")
    arguments = parser.parse_args()
    unknown = set(arguments.targets).difference(targets)
    if unknown:
        parser.error(f"unknown target '{min(unknown)}': choose from {', '.join(targets)}")
    for target in arguments.targets or targets:
        archive = build(target, arguments.output.resolve())
        print(f"{os.path.relpath(archive)}  {archive.stat().st_size / MEGABYTE:.1f} MB", flush=True)
        for name, size in wheel_sizes(archive):
            print(f"    {size / MEGABYTE:5.1f} MB  {name}")


def build(target: str, output: Path) -> Path:
    """The zip of one target, in a folder that is created if missing."""
    output.mkdir(parents=True, exist_ok=True)
    source = output / "sources" / target
    copy_sources(source, target, [] if target == NO_WHEELS else download_wheels(target))
    try:
        return build_zip(source, output, target)
    finally:
        shutil.rmtree(source)


def with_pymeshlab() -> bool:
    """Whether the environment asks for PyMeshLab in the zips."""
    return os.environ.get("WITH_PYMESHLAB", "0") not in ("", "0")


def download_wheels(platform: str) -> list[Path]:
    """The wheels for one platform and every Python, fetched where they are not there yet."""
    tags = [word for tag in PLATFORMS[platform] for word in ("--platform", tag)]
    wheels = {}
    for python, name in PYTHONS.items():
        folder = WHEELS / platform / python
        locks = [ROOT / "extension" / lock for lock in (name, *([PYMESHLAB] if with_pymeshlab() else []))]
        requirements = [word for lock in locks for word in ("-r", str(lock))]
        options = ["--quiet", "--disable-pip-version-check", "--no-deps", "--require-hashes", "--only-binary", ":all:", *tags]
        run("-m", "pip", "download", *options, "--python-version", python, "--dest", str(folder), *requirements)
        locked = "".join(lock.read_text() for lock in locks)  # wheels of an earlier lock may lie there too
        wheels.update({wheel.name: wheel for wheel in folder.glob("*.whl") if sha256(wheel.read_bytes()).hexdigest() in locked})
    return [wheels[name] for name in sorted(wheels)]


def copy_sources(copy: Path, target: str, wheels: list[Path]) -> None:
    """A copy of the repository with the wheels beside it and listed in its manifest."""
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(".*", "__pycache__", "build", "out", "wheels"))
    (copy / "wheels").mkdir()
    for wheel in wheels:
        shutil.copyfile(wheel, copy / "wheels" / wheel.name)
    manifest = copy / "blender_manifest.toml"
    if target != NO_WHEELS:
        manifest.write_text(with_wheels(manifest.read_text(), target, [wheel.name for wheel in wheels]))
    for path in copy.rglob("*"):
        if path.is_file():
            path.chmod(0o644)
            os.utime(path, (ZIP_TIME, ZIP_TIME))


def with_wheels(manifest: str, platform: str, names: list[str]) -> str:
    """The manifest's text with its platform and its wheels; both must stand before the first table."""
    head, table, rest = manifest.partition("\n[permissions]")
    wheels = "".join(f'  "./wheels/{name}",\n' for name in names)
    return f'{head}\nplatforms = ["{platform}"]\nwheels = [\n{wheels}]\n{table}{rest}'


def build_zip(source: Path, folder: Path, target: str) -> Path:
    """Build the zip of a copy of the sources into a folder, then validate what was built."""
    archive = folder / archive_name(tomllib.loads((source / "blender_manifest.toml").read_text()), target)
    tool = next(Path(find_spec("bpy").origin).parent.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py"))
    run(str(tool), "build", "--source-dir", str(source), "--output-filepath", str(archive))
    run(str(tool), "validate", str(archive))
    return archive


def archive_name(manifest: dict, target: str) -> str:
    """Name of the zip of one target."""
    extra = "-pymeshlab" if with_pymeshlab() and target != NO_WHEELS else ""
    return f"{manifest['id']}-{manifest['version']}-{target}{extra}.zip"


def wheel_sizes(archive: Path) -> list[tuple[str, int]]:
    """Name and bytes of each wheel in a zip, the largest first."""
    with zipfile.ZipFile(archive) as opened:
        wheels = [(item.filename.rpartition("/")[2], item.compress_size) for item in opened.infolist() if item.filename.endswith(".whl")]
    return sorted(wheels, key=lambda wheel: -wheel[1])


def run(*arguments: str) -> None:
    """Run Python on the arguments, silently unless it fails; stop where it does."""
    result = subprocess.run([sys.executable, *arguments], env={**os.environ, "TZ": "UTC"}, capture_output=True, text=True)
    if result.returncode != 0:
        sys.exit(f"{result.stdout}{result.stderr}extension/build.py: failed: {' '.join(arguments)}")


if __name__ == "__main__":
    main()
