"""What `trial.py` runs inside a Blender: one chapter of an installed extension's life. Arguments: CHAPTER ZIP SAMPLE OUTPUT

Plain Python over bpy, so that the executable and the bpy package of every version can run it. Raises where anything is not as it should be.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path

import bpy

REPOSITORY = "user_default"
NAME = "refmesh"
MODULE = f"bl_ext.{REPOSITORY}.{NAME}"
FRAMES = "40-43"  # of the sample: one group, and fast
MOST_DISTANCE = 0.002  # mean distance that a good run of the draft preset stays well below, as a share of the diagonal


def whole_life(archive: str, sample: str, output: str) -> dict:
    """Install, enable, run the main job, disable, enable, remove."""
    install(archive)
    check_enabled()
    bpy.ops.refmesh.check_installation()
    started = time.monotonic()
    distance = run_job(sample, output)
    seconds = time.monotonic() - started
    bpy.ops.preferences.addon_disable(module=MODULE)
    check_gone()
    bpy.ops.preferences.addon_enable(module=MODULE)
    check_enabled()
    remove()
    return {"seconds": round(seconds, 1), "mean distance, % of the diagonal": round(100 * distance, 4)}


def only_install(archive: str, sample: str, output: str) -> dict:
    """Install and enable, for a later process."""
    install(archive)
    check_enabled()
    return {}


def crippled(archive: str, sample: str, output: str) -> dict:
    """What was installed has a package that cannot be loaded: enabled all the same, and every door says what is wrong."""
    bpy.ops.preferences.addon_enable(module=MODULE)
    return speak_up(sample, output)


def without_wheels(archive: str, sample: str, output: str) -> dict:
    """A zip without packages: enabled all the same; it runs on the system's packages, or says which are missing."""
    install(archive)
    check_enabled()
    try:
        bpy.ops.refmesh.check_installation()
    except RuntimeError:
        said = speak_up(sample, output)
    else:
        said = {"mean distance, % of the diagonal": round(100 * run_job(sample, output), 4), "packages": "the system's own"}
    remove()
    return said


def install(archive: str) -> None:
    bpy.ops.extensions.package_install_files(filepath=archive, repo=REPOSITORY, enable_on_install=True)


def remove() -> None:
    repositories = [item.module for item in bpy.context.preferences.extensions.repos]
    bpy.ops.extensions.package_uninstall(repo_index=repositories.index(REPOSITORY), pkg_id=NAME)
    check_gone()
    folder = Path(bpy.utils.user_resource("EXTENSIONS")) / REPOSITORY / NAME
    assert not folder.exists(), f"{folder} is left behind"


def check_enabled() -> None:
    assert MODULE in bpy.context.preferences.addons, f"{MODULE} is not enabled"
    assert "run_all" in dir(bpy.ops.refmesh), "no operator was registered"
    assert hasattr(bpy.types, "REFMESH_PT_run"), "no panel was registered"


def check_gone() -> None:
    assert MODULE not in bpy.context.preferences.addons, f"{MODULE} is still enabled"
    assert not dir(bpy.ops.refmesh), "operators stay behind"
    assert not hasattr(bpy.types.Object, "refmesh"), "properties stay behind"


def run_job(sample: str, output: str) -> float:
    """The whole job by the operators that the panel has; gives the largest mean distance of a frame."""
    operators = bpy.ops.refmesh
    operators.import_sequence(filepath=sample, frames=FRAMES, empty_scene=True)
    operators.run_all(output=output, preset="draft", quiet=True)
    operators.export(format="pc2")
    for kind in ("abc", "usd"):
        if getattr(bpy.app.build_options, {"abc": "alembic"}.get(kind, kind)):
            operators.export(format=kind)
    operators.save_scene(filepath=os.path.join(output, "scene.blend"))
    report = json.loads((Path(output) / "report.json").read_text(encoding="utf-8"))
    assert [frame["number"] for frame in report["frames"]] == [40, 41, 42, 43], report["frames"]
    assert all((Path(output) / frame["deformed"]).is_file() for frame in report["frames"])
    worst = max(frame[way]["mean"] for frame in report["frames"] for way in ("source_to_deformed", "deformed_to_source"))
    assert 0 < worst < MOST_DISTANCE, f"the deformed meshes lie {100 * worst:.3f} % of the diagonal off"
    return worst


def speak_up(sample: str, output: str) -> dict:
    """Gathers what the add-on says where it cannot work; silence, a traceback or success would be wrong."""
    check_enabled()
    said = {"check": refusal(bpy.ops.refmesh.check_installation)}
    said["job"] = refusal(lambda: run_job(sample, output))
    return said


def refusal(action) -> str:
    """The message with which an operator refuses."""
    try:
        action()
    except RuntimeError as error:
        message = str(error).strip()
        assert "Traceback" not in message, message
        return message.splitlines()[0].removeprefix("Error: ")
    raise AssertionError("it should have refused")


def main() -> None:
    arguments = sys.argv[sys.argv.index("--") + 1 :]
    chapter = {"whole-life": whole_life, "install": only_install, "crippled": crippled, "without-wheels": without_wheels}[arguments[0]]
    results = chapter(*arguments[1:])
    versions = {"blender": bpy.app.version_string, "python": sys.version.split()[0]}
    Path(arguments[3]).mkdir(parents=True, exist_ok=True)
    (Path(arguments[3]) / f"{arguments[0]}.json").write_text(json.dumps({**versions, **results}, indent=2), encoding="utf-8")
    if bpy.app.version < (4, 3) and not bpy.app.binary_path:
        # As a Python module, Blender 4.2 crashes at its end once any extension with a panel was removed, even one of ten lines.
        sys.stdout.flush()
        os._exit(0)


main()
