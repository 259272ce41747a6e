"""RefMesh without a window: reads a mesh sequence, runs every step, writes everything to one folder.

    blender -b -P headless/run.py -- INPUT --output OUT [options]
    python headless/run.py INPUT --output OUT [options]

Everything is done by the operators of the add-on, and the options below are made from theirs. An installed extension
is used where there is one, else the checkout that this file lies in.
Exit code: 0 when everything asked for was written, 1 when something failed, 2 when the options are wrong.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from fnmatch import fnmatch
from pathlib import Path
from typing import TextIO

CHECKOUT = Path(__file__).resolve().parents[1]
EXIT_FAILED, EXIT_USAGE = 1, 2
STEPS = ("import_sequence", "import_scene", "run_all")  # the operators whose arguments become options
RENAMED = {"filepath", "output", "quiet"}  # arguments that have a place of their own below
NOT_EXPORT_OPTIONS = {"format", "directory", "scope"}  # of the export operator; its other arguments become --export-...
AUTOMATIC = "0 (auto)"  # in the description of an argument: the option takes the word too
CHECK_TEXT, CHECK_DATA = "sequence_check.txt", "sequence_check.json"  # in OUT
NOT_RESULTS = "cache"  # folder in OUT that only helps the next run


class OneLineParser(argparse.ArgumentParser):
    """Says in one line what is wrong; `--help` shows the rest."""

    def error(self, message):
        self.exit(EXIT_USAGE, f"{message} (--help lists the options)\n")


def main() -> int:
    """Does the job and gives the exit code."""
    try:
        import bpy
    except ImportError:
        return fail(
            "the Python package 'bpy' is missing: run 'make demo' once, or use 'blender -b -P headless/run.py -- INPUT --output OUT'"
        )
    checkout = register_checkout(bpy)
    try:
        arguments = vars(make_parser(bpy).parse_args(own_arguments(bpy)))
        stdout = claim_stdout()
        run(bpy, arguments)
    except RuntimeError as error:
        return fail(one_line(error))
    finally:
        if checkout:
            checkout.unregister()  # some versions of bpy crash or hang at their end when handlers are left
    if arguments["check"]:
        return tell_findings(arguments, stdout)
    if not arguments["quiet"]:
        print(*written(arguments), sep="\n", file=stdout, flush=True)
    return 0


def tell_findings(arguments: dict, stdout: TextIO) -> int:
    """Prints what the check found; an error, which would stop the job, gives the exit code of a failure."""
    output = Path(arguments["output"])
    if not arguments["quiet"]:
        print((output / CHECK_TEXT).read_text(encoding="utf-8"), end="", file=stdout, flush=True)
    findings = json.loads((output / CHECK_DATA).read_text(encoding="utf-8"))["findings"]
    return EXIT_FAILED if any(finding["severity"] == "error" for finding in findings) else 0


def fail(message: str) -> int:
    """Says why there is no result."""
    print(message, file=sys.stderr)
    return EXIT_FAILED


def claim_stdout() -> TextIO:
    """The real stdout, for the list of files alone; what Blender, its renderer and its exporters print there is dropped."""
    stdout = os.fdopen(os.dup(1), "w", encoding="utf-8")
    with open(os.devnull, "wb") as nowhere:
        os.dup2(nowhere.fileno(), 1)
    return stdout


def register_checkout(bpy):
    """Registers the add-on of this checkout and gives it; None where an installed extension has registered already."""
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


def make_parser(bpy) -> argparse.ArgumentParser:
    """Options made from the arguments of the operators: name, help, default, bounds and choices."""
    parser = OneLineParser(prog="run.py", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False)
    parser.add_argument("input", metavar="INPUT", help="folder, one file of a sequence, pattern such as 'scan_*.obj', or .abc or .usd file")
    parser.add_argument("--output", required=True, metavar="OUT", help="folder for everything that is written")
    for argument in {name: argument for step in reversed(STEPS) for name, argument in operator_arguments(bpy, step).items()}.values():
        add_option(parser, argument)
    formats = bpy.ops.refmesh.export.get_rna_type().properties["format"].enum_items
    parser.add_argument(
        "--export", action="append", default=[], choices=formats.keys(), help=f"{choices_in_words(formats)}; may be repeated"
    )
    for argument in export_arguments(bpy).values():
        add_option(parser, argument, "export_")
    parser.add_argument("--preview", metavar="FILE.png", help="picture of source, reference mesh and result")
    parser.add_argument(
        "--check", action="store_true", help="only look at every frame and print what is wrong; exit code 1 when the job would fail"
    )
    parser.add_argument("--quiet", action="store_true", help="no progress bar and no list of files")
    return parser


def operator_arguments(bpy, name: str) -> dict:
    """name -> RNA property of each argument of an operator that becomes an option."""
    properties = getattr(bpy.ops.refmesh, name).get_rna_type().properties
    return {item.identifier: item for item in properties if not (item.is_hidden or item.type == "POINTER" or item.identifier in RENAMED)}


def export_arguments(bpy) -> dict:
    """name -> RNA property of each argument of the export operator that becomes an option, those of single formats among them."""
    return {name: argument for name, argument in operator_arguments(bpy, "export").items() if name not in NOT_EXPORT_OPTIONS}


def add_option(parser: argparse.ArgumentParser, argument, prefix: str = "") -> None:
    """The option for one argument; one that is not given is not passed, so that a preset can decide."""
    name = prefix + argument.identifier
    option = {"dest": name, "default": argparse.SUPPRESS, "help": argument.description.replace("%", "%%")}
    if argument.type == "BOOLEAN":
        option["action"] = argparse.BooleanOptionalAction
    elif argument.type == "ENUM":
        option |= {"choices": argument.enum_items.keys(), "help": f"{option['help']}: {choices_in_words(argument.enum_items)}"}
    elif argument.type in ("INT", "FLOAT"):
        option |= {"type": number_within(argument), "metavar": "N"}
    else:
        option["metavar"] = "TEXT"
    if argument.type != "STRING":
        option["help"] += f" (default: {argument.default:.6g})" if argument.type == "FLOAT" else f" (default: {argument.default})"
    parser.add_argument("--" + name.replace("_", "-"), **option)


def number_within(argument):
    """A converter for the option's text that keeps to the argument's bounds; Blender itself would move a value silently."""
    low, high = argument.hard_min, argument.hard_max
    automatic = AUTOMATIC in argument.description

    def convert(text: str) -> float:
        if automatic and text == "auto":
            return 0
        try:
            value = int(text) if argument.type == "INT" else float(text)
        except ValueError:
            value = None
        if value is None or not low <= value <= high:
            raise argparse.ArgumentTypeError(f"'{text}' is not {'auto or ' * automatic}a number from {low:g} to {high:g}")
        return value

    return convert


def choices_in_words(items) -> str:
    """Each choice and what it means."""
    return "; ".join(f"{item.identifier}: {item.description}" for item in items).replace("%", "%%")


def run(bpy, arguments: dict) -> None:
    """All steps, by operators and nothing else. Raises RuntimeError when one fails."""
    operators = bpy.ops.refmesh
    output = os.path.abspath(arguments["output"])
    passed = {
        step: {name: arguments[name] for name in operator_arguments(bpy, step) if name in arguments} for step in (*STEPS, "check_sequence")
    }
    if is_scene_file(bpy, arguments["input"]):
        operators.import_scene(filepath=os.path.abspath(arguments["input"]), empty_scene=True, **passed["import_scene"])
        scene = bpy.context.scene
        operators.import_object(output=output, first=max(scene.frame_start, 0), last=scene.frame_end)
    else:
        operators.import_sequence(filepath=os.path.abspath(arguments["input"]), empty_scene=True, **passed["import_sequence"])
    if arguments["check"]:
        operators.check_sequence(output=output, quiet=arguments["quiet"], **passed["check_sequence"])
        return
    for kind in arguments["export"]:
        operators.export(format=kind, only_check=True)  # before hours of work
    operators.run_all(output=output, quiet=arguments["quiet"], **passed["run_all"])
    options = {name: arguments[f"export_{name}"] for name in export_arguments(bpy) if f"export_{name}" in arguments}
    for kind in arguments["export"]:
        operators.export(format=kind, **options)
    if arguments["preview"]:
        operators.render_preview(filepath=os.path.abspath(arguments["preview"]))
    operators.save_scene(filepath=os.path.join(output, "scene.blend"))


def is_scene_file(bpy, path: str) -> bool:
    """Whether the input is a file that holds an animated scene, by its extension."""
    patterns = bpy.ops.refmesh.import_scene.get_rna_type().properties["filter_glob"].default
    return any(fnmatch(path.lower(), pattern) for pattern in patterns.split(";"))


def written(arguments: dict) -> list[str]:
    """The results, as paths that can be opened from here."""
    output = Path(arguments["output"])
    files = sorted(path for path in output.rglob("*") if path.is_file() and NOT_RESULTS not in path.relative_to(output).parts)
    preview = [Path(arguments["preview"])] if arguments["preview"] else []
    return list(dict.fromkeys(str(path) for path in files + preview))


def one_line(error: RuntimeError) -> str:
    """The message of an operator without what Blender puts around it."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip() and not line.startswith("Location: ")]
    if any("Traceback" in line for line in lines):
        return f"internal error: {lines[-1]}"
    reports = [line.removeprefix("Error: ") for line in lines if line.startswith("Error: ")]
    return (reports or lines or ["failed without a message"])[0]


if __name__ == "__main__":
    sys.exit(main())
