"""Try the extension's zips in every Blender that they are for: python extension/trial.py [--zips FOLDER] [NAME ...]

Each Blender starts from nothing, in a folder of its own under build/trials: the zip is installed and enabled, runs the main
job on a sample, is disabled, enabled and removed; then the same zip with a broken package, and the zip without wheels.
The bpy packages come from the package index. PYTHON313 names a Python 3.13 with pip, for bpy 5.2, and BLENDER a Blender;
both are looked for on PATH, and what is not there is left out and named. Each may be a script that starts the real one elsewhere.
Exit code: 1 when a trial failed.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from extension.build import archive_name

ROOT = Path(__file__).resolve().parent.parent
TRIALS = ROOT / "build" / "trials"
SAMPLE = ROOT / "sample_scenes" / "grasp" / "frames"
STEPS = ROOT / "extension" / "trial_steps.py"
TIME_LIMIT = 1800.0  # seconds for one chapter; some versions of Blender hang at their end when an add-on leaves something behind
BROKEN = "scipy"  # the package that is broken on purpose; every stage needs it
PACKAGES = {  # Blender series -> what is installed for it; numpy is what the official builds of the series carry
    "4.2": ("bpy==4.2.23", "numpy==1.26.4"),
    "4.5": ("bpy==4.5.15", "numpy==1.26.4"),
    "5.0": ("bpy==5.0.1", "numpy==1.26.4"),
    "5.2": ("bpy==5.2.3", "numpy==2.3.5"),
}


class TrialFailed(Exception):
    """A Blender did not do what it should; the message is what it said."""


@dataclass(frozen=True)
class Blender:
    """One Blender to try. command : starts it on a Python script, whose arguments follow `--`.  folder : its own under TRIALS."""

    name: str
    command: tuple[str, ...]
    environment: dict[str, str]

    @property
    def folder(self) -> Path:
        return TRIALS / self.name.replace(" ", "-")

    def run_steps(self, chapter: str, archive: Path, user: str) -> dict:
        """Runs a chapter of trial_steps.py with the settings folder `user`; returns its results."""
        output = self.folder / chapter
        shutil.rmtree(output, ignore_errors=True)
        self.run([*self.command, str(STEPS), "--", chapter, str(archive), str(SAMPLE), str(output)], user)
        return json.loads((output / f"{chapter}.json").read_text(encoding="utf-8"))

    def run(self, command: list[str], user: str) -> str:
        """Runs a command with the settings folder `user`, and gives its output; raises TrialFailed."""
        settings = self.folder / user
        settings.mkdir(parents=True, exist_ok=True)
        environment = {**os.environ, **self.environment, "BLENDER_USER_RESOURCES": str(settings)}
        try:
            done = subprocess.run(command, env=environment, cwd=ROOT, capture_output=True, text=True, timeout=TIME_LIMIT)
        except subprocess.TimeoutExpired as error:
            raise TrialFailed(f"still running after {TIME_LIMIT:.0f} seconds: {' '.join(command)}") from error
        if done.returncode != 0:
            raise TrialFailed(f"exit code {done.returncode}: {' '.join(command)}\n{done.stdout[-2000:]}{done.stderr[-4000:]}")
        return done.stdout


def main() -> int:
    """Tries what the command line names, prints a line for each trial, and gives the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    names = [*(f"bpy {series}" for series in PACKAGES), "blender"]
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"one of {', '.join(map(repr, names))}; all of them by default")
    parser.add_argument("--zips", type=Path, default=ROOT / "build", metavar="FOLDER", help="where the zips are (default: build)")
    arguments = parser.parse_args()
    if unknown := set(arguments.names).difference(names):
        parser.error(f"unknown name '{min(unknown)}': choose from {', '.join(map(repr, names))}")
    archive, bare = (zip_of(arguments.zips.resolve(), target) for target in ("linux-x64", "no-wheels"))
    failed = 0
    for name in arguments.names or names:
        blender = find_blender(name)
        if blender is None:
            continue
        shutil.rmtree(blender.folder, ignore_errors=True)
        for trial, action in trials(blender, archive, bare):
            failed += not passes(f"{name}: {trial}", action)
    print(f"{failed} trials failed" if failed else "every trial passed")
    return 1 if failed else 0


def trials(blender: Blender, archive: Path, bare: Path) -> list[tuple[str, Callable[[], dict]]]:
    """Name and action of each trial of one Blender."""
    steps = [
        ("whole life", lambda: blender.run_steps("whole-life", archive, "user")),
        (f"broken {BROKEN}", lambda: try_broken(blender, archive)),
        ("no wheels", lambda: blender.run_steps("without-wheels", bare, "user-without-wheels")),
    ]
    return [*steps, ("command line", lambda: try_command_line(blender, archive))] if blender.name == "blender" else steps


def passes(name: str, action: Callable[[], dict]) -> bool:
    """Runs a trial and prints how it went."""
    try:
        results = action()
    except TrialFailed as failure:
        print(f"{name}: FAILED\n{failure}", flush=True)
        return False
    print(f"{name}: passed; {'; '.join(f'{key}: {value}' for key, value in results.items())}", flush=True)
    return True


def find_blender(name: str) -> Blender | None:
    """The Blender of that name, installed if need be; None, with a word why, where this machine has not what it takes."""
    kind, _, series = name.partition(" ")
    if kind == "blender":
        program = os.environ.get("BLENDER") or shutil.which("blender")
        if not program:
            print("blender: skipped, there is none on PATH and BLENDER names none", flush=True)
            return None
        return Blender(name, (program, "-b", "--factory-startup", "--python-exit-code", "1", "-P"), {})
    # The Python that .venv was created from: one without the packages in .venv, as if Blender were alone.
    own = str(Path(sys.base_prefix, "bin", "python3.11"))
    python = own if series < "5.1" else os.environ.get("PYTHON313") or shutil.which("python3.13")
    if python != own and not has_pip(python):
        print(f"{name}: skipped, there is no Python 3.13 with pip on PATH and PYTHON313 names none", flush=True)
        return None
    packages = install_packages(sys.executable if python == own else python, series)
    return Blender(name, (python, "-s", "-S"), {"PYTHONPATH": str(packages)})


def has_pip(python: str | None) -> bool:
    return bool(python) and subprocess.run([python, "-m", "pip", "--version"], capture_output=True).returncode == 0


def install_packages(python: str, series: str) -> Path:
    """The folder with the bpy package of a series, created if missing."""
    packages = PACKAGES[series]
    folder = TRIALS / "packages" / "-".join(packages).replace("==", "-")
    if not folder.exists():
        partial = folder.with_name(f"{folder.name}.partial")
        shutil.rmtree(partial, ignore_errors=True)
        print(f"installing {' '.join(packages)} (300 MB to fetch, 1 GB on disk)", flush=True)
        options = ["--quiet", "--disable-pip-version-check", "--only-binary", ":all:", "--target", str(partial)]
        subprocess.run([python, "-m", "pip", "install", *options, *packages], check=True)
        partial.rename(folder)
    return folder


def try_broken(blender: Blender, archive: Path) -> dict:
    """Installs, then makes every compiled file of one package ask for a system library that no machine has yet."""
    blender.run_steps("install", archive, "user-broken")
    compiled = [path for path in (blender.folder / "user-broken").rglob("*.so") if BROKEN in path.parts]
    if not compiled:
        raise TrialFailed(f"no compiled file of {BROKEN} was unpacked")
    for path in compiled:
        path.write_bytes(path.read_bytes().replace(b"\0GLIBC_2.", b"\0GLIBC_9."))
    results = blender.run_steps("crippled", archive, "user-broken")
    if not all(BROKEN in results[door] for door in ("check", "job")):
        raise TrialFailed(f"{BROKEN} is broken, but that is not what is said: {results}")
    return results


def try_command_line(blender: Blender, archive: Path) -> dict:
    """Installs and removes by Blender's own command line, and runs the job by the installed extension's script."""
    program, output = blender.command[0], blender.folder / "command-line"
    extension = [program, "--command", "extension"]
    blender.run([*extension, "install-file", "-r", "user_default", "--enable", str(archive)], "user-command-line")
    script = next((blender.folder / "user-command-line").rglob("headless/run.py"))
    options = ["--output", str(output), "--frames", "40-41", "--preset", "draft", "--export", "glb"]
    listed = blender.run([program, "-b", "--python-exit-code", "1", "-P", str(script), "--", str(SAMPLE), *options], "user-command-line")
    blender.run([*extension, "remove", "refmesh"], "user-command-line")
    if script.exists():
        raise TrialFailed(f"{script} is left behind")
    return {"files written": len(listed.splitlines())}


def zip_of(folder: Path, target: str) -> Path:
    path = folder / archive_name(tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8")), target)
    if not path.is_file():
        sys.exit(f"{path} is missing: run 'make extension' first")
    return path


if __name__ == "__main__":
    sys.exit(main())
