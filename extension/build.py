"""Build the extension's zip with Blender's own tool: python extension/build.py [PLATFORM ...]

Wheels of the locked versions go to wheels/, the zip of each platform to build/. The same sources give the same bytes.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tomllib
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WHEELS = ROOT / "wheels"
BUILD = ROOT / "build"
PYTHONS = {"3.11": "wheels-cp311.txt", "3.13": "wheels-cp313.txt"}  # Blender 4.2 to 5.0, and from 5.1 on
# Blender's name -> the tags that pip may take wheels of. Each tag is matched as it stands, so all that may occur are listed.
PLATFORMS = {
    "linux-x64": ["manylinux2014_x86_64", "manylinux_2_27_x86_64", "manylinux_2_28_x86_64", "manylinux_2_35_x86_64"],
}
ZIP_TIME = 1_577_836_800  # 2020-01-01: files in the zip carry this time, not that of their checkout


def main(platforms: list[str]) -> None:
    for platform in platforms or PLATFORMS:
        source = BUILD / "extension" / platform
        copy_sources(source, platform, download_wheels(platform))
        archive = build_zip(source, BUILD)
        print(f"{archive.relative_to(ROOT)}  {archive.stat().st_size / 1e6:.1f} MB")


def download_wheels(platform: str) -> list[Path]:
    """The wheels for one platform and every Python, fetched where they are not there yet."""
    tags = [word for tag in PLATFORMS[platform] for word in ("--platform", tag)]
    wheels = {}
    for python, name in PYTHONS.items():
        lock, folder = ROOT / "extension" / name, WHEELS / platform / python
        options = ["--quiet", "--disable-pip-version-check", "--no-deps", "--require-hashes", "--only-binary", ":all:", *tags]
        run("-m", "pip", "download", *options, "--python-version", python, "--dest", str(folder), "-r", str(lock))
        locked = lock.read_text()  # wheels of an earlier lock may lie there too
        wheels.update({wheel.name: wheel for wheel in folder.glob("*.whl") if sha256(wheel.read_bytes()).hexdigest() in locked})
    return [wheels[name] for name in sorted(wheels)]


def copy_sources(copy: Path, platform: str, wheels: list[Path]) -> None:
    """A copy of the repository with the wheels beside it and listed in its manifest."""
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(".*", "__pycache__", "build", "out", "wheels"))
    (copy / "wheels").mkdir()
    for wheel in wheels:
        shutil.copyfile(wheel, copy / "wheels" / wheel.name)
    manifest = copy / "blender_manifest.toml"
    manifest.write_text(with_wheels(manifest.read_text(), platform, [wheel.name for wheel in wheels]))
    for path in copy.rglob("*"):
        if path.is_file():
            path.chmod(0o644)
            os.utime(path, (ZIP_TIME, ZIP_TIME))


def with_wheels(manifest: str, platform: str, names: list[str]) -> str:
    """The manifest's text with its platform and its wheels; both must stand before the first table."""
    head, table, rest = manifest.partition("\n[permissions]")
    wheels = "".join(f'  "./wheels/{name}",\n' for name in names)
    return f'{head}\nplatforms = ["{platform}"]\nwheels = [\n{wheels}]\n{table}{rest}'


def build_zip(source: Path, folder: Path) -> Path:
    """Build the zip of a copy of the sources into a folder, then validate what was built."""
    manifest = tomllib.loads((source / "blender_manifest.toml").read_text())
    archive = folder / f"{manifest['id']}-{manifest['version']}-{manifest['platforms'][0]}.zip"
    tool = next(Path(find_spec("bpy").origin).parent.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py"))
    run(str(tool), "build", "--source-dir", str(source), "--output-filepath", str(archive))
    run(str(tool), "validate", str(archive))
    return archive


def run(*arguments: str) -> None:
    """Run Python on the arguments; stop where it fails."""
    result = subprocess.run([sys.executable, *arguments], env={**os.environ, "TZ": "UTC"})
    if result.returncode != 0:
        sys.exit(f"extension/build.py: failed: {' '.join(arguments)}")


if __name__ == "__main__":
    main(sys.argv[1:])
