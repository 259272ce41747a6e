"""RefMesh without a window: reads a mesh sequence, runs every step, writes everything to one folder.

    blender -b -P headless/run.py -- INPUT --output OUT [options]
    python headless/run.py INPUT --output OUT [options]
    python headless/run.py --batch takes.csv --output OUT [options]
    python headless/run.py decode FILE.refmesh --output FOLDER

Everything is done by the operators of the add-on, and the options are made from their arguments. An installed extension
is used where there is one, else the checkout that contains this file.
Exit code: 0 when everything requested was written, 1 when something failed, 2 when the options are wrong, 130 when it was
interrupted; of a batch, how many takes failed.
"""

from __future__ import annotations

import json
import os
import sys
from argparse import ArgumentParser
from fnmatch import fnmatch
from pathlib import Path
from typing import TextIO

sys.path.insert(0, str(Path(__file__).resolve().parent))  # Blender's -P does not
from batch import EXIT_INTERRUPTED, BatchJob, run_batch  # noqa: E402
from operator_options import STEPS, export_arguments, make_decode_parser, make_parser, operator_arguments  # noqa: E402
from takes import Columns  # noqa: E402

CHECKOUT = Path(__file__).resolve().parents[1]
EXIT_FAILED = 1
DECODE = "decode"  # as the first argument; a folder of this name is given as ./decode
CHECK_TEXT, CHECK_DATA = "sequence_check.txt", "sequence_check.json"  # in OUT
NOT_RESULTS = "cache"  # folder in OUT that only speeds up the next run


def main() -> int:
    """Runs the job and returns the exit code."""
    try:
        import bpy
    except ImportError:
        return fail(
            "the Python package 'bpy' is missing: run 'make demo' once, or use 'blender -b -P headless/run.py -- INPUT --output OUT'"
        )
    checkout = register_checkout(bpy)
    try:
        if own_arguments(bpy)[:1] == [DECODE]:
            return decode(bpy, own_arguments(bpy)[1:])
        parser = make_parser(bpy, __doc__)
        arguments = vars(parser.parse_args(own_arguments(bpy)))
        check_together(parser, arguments)
        if arguments["batch"]:
            return run_batch(batch_job(bpy, arguments), batch_columns(bpy))
        stdout = claim_stdout()
        run(bpy, arguments)
    except RuntimeError as error:
        return fail(one_line(error))
    except KeyboardInterrupt:
        return fail("interrupted: the same command continues")
    finally:
        if checkout:
            checkout.unregister()  # some versions of bpy crash or hang at exit when handlers are left
    if arguments["check"]:
        return print_findings(arguments, stdout)
    if not arguments["quiet"]:
        print(*written_files(arguments), sep="\n", file=stdout, flush=True)
    return 0


def check_together(parser: ArgumentParser, arguments: dict) -> None:
    """Ends the script with exit code 2 for options that exclude each other."""
    if bool(arguments["input"]) == bool(arguments["batch"]):
        parser.error("give either INPUT or --batch TAKES")
    if arguments["export_job"] and (arguments["batch"] or arguments["export_job"][0] != "openjd"):
        parser.error("--export-job takes openjd and a folder, and a single INPUT")


def decode(bpy, words: list[str]) -> int:
    """Writes the frames of a compressed file and prints their paths."""
    arguments, stdout = make_decode_parser(DECODE).parse_args(words), claim_stdout()
    folder = Path(arguments.output)
    bpy.ops.refmesh.decode_stream(filepath=os.path.abspath(arguments.file), output=os.path.abspath(folder))
    if not arguments.quiet:
        print(*sorted(folder.glob("frame_*.ply")), sep="\n", file=stdout, flush=True)
    return 0


def batch_job(bpy, arguments: dict) -> BatchJob:
    """What to do for each take: this script again, without the options that belong to a single take or to the batch."""
    paths = [os.path.abspath(arguments[name]) for name in ("batch", "output")]
    own_mesh = [f"--mesh={os.path.abspath(arguments['mesh'])}"] if arguments.get("mesh") else []
    options = [*without_options(own_arguments(bpy), {"--batch": 1, "--output": 1, "--preview": 1, "--mesh": 1}), *own_mesh]
    return BatchJob(*map(Path, paths), tuple(options), arguments["preview"] or "", arguments["check"], tuple(own_command(bpy)))


def own_command(bpy) -> list[str]:
    """What starts this script again, up to its arguments."""
    if bpy.app.binary_path:
        return [bpy.app.binary_path, *sys.argv[1 : sys.argv.index("--")], "--"]
    return [sys.executable, os.path.abspath(__file__)]


def batch_columns(bpy) -> Columns:
    """The options that a row may hold."""
    options = {name: argument for step in STEPS for name, argument in operator_arguments(bpy, step).items()}
    options |= {f"export_{name}": argument for name, argument in export_arguments(bpy).items()}
    named = {name.replace("_", "-"): argument.type == "BOOLEAN" for name, argument in options.items()}
    switches = frozenset(name for name, switch in named.items() if switch)
    return Columns(switches, frozenset(named) - switches | {"export", "preview"}, lambda path: is_scene_file(bpy, path))


def without_options(arguments: list[str], values: dict[str, int]) -> list[str]:
    """A command line without some options. values : how many values follow each, or one as in `--name=value`."""
    kept, skip = [], 0
    for argument in arguments:
        if skip:
            skip -= 1
        elif argument in values:
            skip = values[argument]
        elif not argument.startswith(tuple(f"{name}=" for name in values)):
            kept.append(argument)
    return kept


def print_findings(arguments: dict, stdout: TextIO) -> int:
    """Prints the findings, which are what a check is for; one that would stop the job gives the exit code of a failure."""
    output = Path(arguments["output"])
    print((output / CHECK_TEXT).read_text(encoding="utf-8"), end="", file=stdout, flush=True)
    findings = json.loads((output / CHECK_DATA).read_text(encoding="utf-8"))["findings"]
    return EXIT_FAILED if any(finding["severity"] == "error" for finding in findings) else 0


def fail(message: str) -> int:
    """Prints why there is no result. An operator that was interrupted says so first."""
    print(message, file=sys.stderr)
    return EXIT_INTERRUPTED if message.startswith("interrupted") else EXIT_FAILED


def claim_stdout() -> TextIO:
    """The real stdout, for the list of files alone; what Blender, its renderer and its exporters print is discarded."""
    stdout = os.fdopen(os.dup(1), "w", encoding="utf-8")
    with open(os.devnull, "wb") as nowhere:
        os.dup2(nowhere.fileno(), 1)
    return stdout


def register_checkout(bpy):
    """Registers the add-on of this checkout and returns it; None where an installed extension is already registered."""
    if "run_all" in dir(bpy.ops.refmesh):
        return None
    sys.path.insert(0, str(CHECKOUT))
    import refmesh_addon

    refmesh_addon.register()
    return refmesh_addon


def own_arguments(bpy) -> list[str]:
    """What follows `--`, since Blender leaves its own arguments in front; all arguments under plain Python."""
    if "--" in sys.argv:
        return sys.argv[sys.argv.index("--") + 1 :]
    return [] if bpy.app.binary_path else sys.argv[1:]


def run(bpy, arguments: dict) -> None:
    """All steps, by operators and nothing else. Raises RuntimeError when one fails."""
    operators = bpy.ops.refmesh
    output, quiet = os.path.abspath(arguments["output"]), arguments["quiet"]
    import_input(bpy, arguments, output)
    if arguments["export_job"]:
        export_job(bpy, arguments, output)
        return
    if arguments["check"]:
        operators.check_sequence(output=output, quiet=quiet, **given(bpy, arguments, "check_sequence"))
        return
    options = {name: arguments[f"export_{name}"] for name in export_arguments(bpy) if f"export_{name}" in arguments}
    for kind in arguments["export"]:
        operators.export(format=kind, only_check=True, **options)  # before hours of computation
    operators.run_all(output=output, quiet=quiet, keep_lock=True, **given(bpy, arguments, "run_all"))
    for kind in arguments["export"]:
        operators.export(format=kind, quiet=quiet, **options)
    if arguments["preview"]:
        operators.render_preview(filepath=os.path.abspath(arguments["preview"]))
    operators.save_scene(filepath=os.path.join(output, "scene.blend"), among_results=True)
    if arguments["clean_cache"]:
        operators.clean_cache(output=output)
    elif not quiet:
        cache = Path(output, NOT_RESULTS)
        print(f"{cache}: {folder_size(cache) / 1e6:.1f} MB for later runs; --clean-cache removes them", file=sys.stderr)


def export_job(bpy, arguments: dict, output: str) -> None:
    """Writes the job for a render farm; its last step is this script again."""
    kind, folder = arguments["export_job"]
    paths = {"--preview": arguments["preview"], "--mesh": arguments.get("mesh")}
    options = without_options(own_arguments(bpy), {"--export-job": 2, "--output": 1, **dict.fromkeys(paths, 1)})
    options.remove(arguments["input"])
    options += [f"{name}={os.path.abspath(path)}" for name, path in paths.items() if path]
    bpy.ops.refmesh.export_job(
        format=kind,
        directory=os.path.abspath(folder),
        output=output,
        scene_command=json.dumps([own_command(bpy), options]),
        **given(bpy, arguments, "export_job"),
    )


def import_input(bpy, arguments: dict, output: str) -> None:
    """Imports the mesh sequence, or one animated object of a scene file, whose frames are written into the output folder."""
    operators, path = bpy.ops.refmesh, os.path.abspath(arguments["input"])
    if not is_scene_file(bpy, path):
        operators.import_sequence(filepath=path, empty_scene=True, **given(bpy, arguments, "import_sequence"))
        return
    operators.import_scene(filepath=path, empty_scene=True, **given(bpy, arguments, "import_scene"))
    scene = bpy.context.scene
    operators.import_object(output=output, first=max(scene.frame_start, 0), last=scene.frame_end)


def given(bpy, arguments: dict, operator: str) -> dict:
    """The arguments of an operator for which an option was given."""
    return {name: arguments[name] for name in operator_arguments(bpy, operator) if name in arguments}


def is_scene_file(bpy, path: str) -> bool:
    """Whether the input is a file that holds an animated scene, by its extension."""
    patterns = bpy.ops.refmesh.import_scene.get_rna_type().properties["filter_glob"].default
    return any(fnmatch(path.lower(), pattern) for pattern in patterns.split(";"))


def folder_size(folder: Path) -> int:
    """Bytes of the files in a folder; one that has several names counts once."""
    states = [path.lstat() for path in folder.rglob("*") if path.is_file()]
    return sum({(state.st_dev, state.st_ino): state.st_size for state in states}.values())


def written_files(arguments: dict) -> list[str]:
    """The results, as paths that can be opened from here."""
    if arguments["export_job"]:
        return sorted(str(path) for path in Path(arguments["export_job"][1]).glob("*.json"))
    output = Path(arguments["output"])
    files = sorted(path for path in output.rglob("*") if path.is_file() and NOT_RESULTS not in path.relative_to(output).parts)
    preview = [Path(arguments["preview"])] if arguments["preview"] else []
    return list(dict.fromkeys(str(path) for path in files + preview))


def one_line(error: RuntimeError) -> str:
    """The message of an operator without what Blender adds to it."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip() and not line.startswith("Location: ")]
    if any("Traceback" in line for line in lines):
        return f"internal error: {lines[-1]}"
    reports = [line.removeprefix("Error: ") for line in lines if line.startswith("Error: ")]
    return (reports or lines or ["failed without a message"])[0]


if __name__ == "__main__":
    sys.exit(main())
