"""Bundle the viewer of web pages with three.js from npm: python web_viewer/build.py [--optional]

The script goes to refmesh_addon/io/web_page/viewer.js, beside the page that it belongs to; three.js (MIT) and the decoder of
meshoptimizer that comes with it (MIT) are part of it, with their notices. Packages are those of package-lock.json, checked by
their hashes. Nothing is done where the script is up to date. With --optional, a missing npm or network is reported but is not a failure.
Standard library only.
"""

from __future__ import annotations

import argparse
import hashlib
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
BUILD = HERE.parent / "build" / "web_viewer"
SCRIPT = HERE.parent / "refmesh_addon" / "io" / "web_page" / "viewer.js"
STAMP = BUILD / "made-from"
SOURCES = ("package.json", "package-lock.json", "viewer.js", "playback.js", "statistics.js", "take.js")
ESBUILD = "node_modules/esbuild/bin/esbuild"
OPTIONS = ("--bundle", "--minify", "--format=iife", "--target=es2022", "--legal-comments=inline", "--log-level=warning")
NOTICE = """The viewer of RefMesh (GPL-3.0-or-later), bundled with three.js and, as part of it, the decoder of meshoptimizer
(Copyright (C) 2016-2026, by Arseny Kapoulkine), both under this license:
"""
WITHOUT = "--export web stays unavailable until 'make web-viewer' succeeds"


def main() -> int:
    """Builds where something has changed; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--optional", action="store_true", help="do not fail where npm or the network is missing")
    optional = parser.parse_args().optional
    if is_current():
        return 0
    problem = build()
    if problem:
        print(f"web_viewer/build.py: {problem}; {WITHOUT}", file=sys.stderr)
        return 0 if optional else 1
    print(f"built {SCRIPT.relative_to(HERE.parent)}: {SCRIPT.stat().st_size / 1e3:.0f} kB, three.js (MIT) included")
    return 0


def is_current() -> bool:
    """Whether the script is what the sources give."""
    return SCRIPT.is_file() and STAMP.is_file() and STAMP.read_text() == fingerprint()


def fingerprint() -> str:
    """Of the sources, and of what they became."""
    contents = [(HERE / name).read_bytes() for name in SOURCES] + [Path(__file__).read_bytes()]
    if SCRIPT.is_file():
        contents.append(SCRIPT.read_bytes())
    return hashlib.sha256(b"\0".join(contents)).hexdigest() + "\n"


def build() -> str:
    """Why there is no script now; "" where there is."""
    npm = shutil.which("npm")
    if not npm or not shutil.which("node"):
        return "npm is not installed (Debian: apt-get install npm)"
    BUILD.mkdir(parents=True, exist_ok=True)
    for name in SOURCES:
        shutil.copyfile(HERE / name, BUILD / name)
    for command in (
        [npm, "ci", "--silent", "--no-audit", "--no-fund", "--ignore-scripts"],
        ["node", ESBUILD, "viewer.js", *OPTIONS, "--outfile=bundle.js"],
    ):
        result = subprocess.run(command, cwd=BUILD, capture_output=True, text=True)
        if result.returncode:
            return f"'{' '.join(command[:2])}' failed: {(result.stderr or result.stdout).strip()[-600:]}"
    license_text = (BUILD / "node_modules" / "three" / "LICENSE").read_text(encoding="utf-8").strip()
    bundle = (BUILD / "bundle.js").read_text(encoding="utf-8")
    SCRIPT.write_text(f"/*! {NOTICE}\n{license_text}\n*/\n{bundle}", encoding="utf-8")
    STAMP.write_text(fingerprint())
    return ""


if __name__ == "__main__":
    sys.exit(main())
