"""The options of the command line, made from the arguments of the add-on's operators."""

from __future__ import annotations

import argparse
import re

EXIT_USAGE = 2
STEPS = ("import_sequence", "import_scene", "run_all")  # the operators whose arguments become options
RENAMED = {"filepath", "output", "quiet"}  # arguments that have a place of their own below
NOT_EXPORT_OPTIONS = {"format", "directory", "scope"}  # of the export operator; its other arguments become --export-...
UNBOUNDED = 2**31 - 1  # the largest integer of Blender: an argument with this maximum has none
WORD = re.compile(r"(-?\d+) \((\w+)\)")  # "0 (auto)" in the description of an argument: the option takes the word too


class OneLineParser(argparse.ArgumentParser):
    """Reports an error in one line; `--help` shows the usage."""

    def error(self, message):
        self.exit(EXIT_USAGE, f"{message} (--help lists the options)\n")


def make_parser(bpy, description: str) -> argparse.ArgumentParser:
    """The parser, with an option for each argument of the operators: name, help, default, bounds and choices."""
    parser = OneLineParser(prog="run.py", description=description, formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False)
    parser.add_argument(
        "input", metavar="INPUT", nargs="?", help="folder, one file of a sequence, pattern such as 'scan_*.obj', or .abc or .usd file"
    )
    parser.add_argument(
        "--batch", metavar="TAKES", help="in place of INPUT: a folder of takes, or a CSV file with the column input and options as columns"
    )
    parser.add_argument("--output", required=True, metavar="OUT", help="folder for everything that is written")
    shared = {name: argument for step in reversed(STEPS) for name, argument in operator_arguments(bpy, step).items()}
    for argument in shared.values():
        add_option(parser, argument)
    formats = bpy.ops.refmesh.export.get_rna_type().properties["format"].enum_items
    parser.add_argument(
        "--export", action="append", default=[], choices=formats.keys(), help=f"{describe_choices(formats)}; may be repeated"
    )
    for argument in export_arguments(bpy).values():
        add_option(parser, argument, "export_")
    parser.add_argument("--preview", type=png_path, metavar="FILE.png", help="picture of source, reference mesh and result")
    parser.add_argument(
        "--check", action="store_true", help="only check every frame and print the findings; exit code 1 when the job would fail"
    )
    parser.add_argument("--clean-cache", action="store_true", help="at the end, remove the intermediate results; they are kept otherwise")
    parser.add_argument(
        "--export-job",
        nargs=2,
        metavar=("openjd", "DIR"),
        help="run nothing, but write the job for a render farm: an Open Job Description template with its steps and tasks",
    )
    parser.add_argument("--quiet", action="store_true", help="no progress bar and no list of files; warnings and errors still go to stderr")
    return parser


def make_decode_parser(command: str) -> argparse.ArgumentParser:
    """The parser of what follows the command that decodes a compressed file."""
    parser = OneLineParser(prog=f"run.py {command}", description="Writes the frames of a compressed file as PLY files.", allow_abbrev=False)
    parser.add_argument("file", metavar="FILE.refmesh", help="file that --export refmesh wrote")
    parser.add_argument("--output", required=True, metavar="FOLDER", help="where to write")
    parser.add_argument("--quiet", action="store_true", help="no list of files")
    return parser


def operator_arguments(bpy, name: str) -> dict:
    """name -> RNA property of each argument of an operator that becomes an option."""
    properties = getattr(bpy.ops.refmesh, name).get_rna_type().properties
    return {item.identifier: item for item in properties if not (item.is_hidden or item.type == "POINTER" or item.identifier in RENAMED)}


def export_arguments(bpy) -> dict:
    """name -> RNA property of each argument of the export operator that becomes an option, including those of single formats."""
    return {name: argument for name, argument in operator_arguments(bpy, "export").items() if name not in NOT_EXPORT_OPTIONS}


def add_option(parser: argparse.ArgumentParser, argument, prefix: str = "") -> None:
    """Adds the option for one argument; an option that is not given is not passed on, so that a preset can set it."""
    name = prefix + argument.identifier
    option = {"dest": name, "default": argparse.SUPPRESS, "help": argument.description.replace("%", "%%")}
    if argument.type == "BOOLEAN":
        option["action"] = argparse.BooleanOptionalAction
    elif argument.type == "ENUM":
        option |= {"choices": argument.enum_items.keys(), "help": f"{option['help']}: {describe_choices(argument.enum_items)}"}
    elif argument.type in ("INT", "FLOAT"):
        option |= {"type": number_within(argument), "metavar": "N"}
    else:
        option["metavar"] = "TEXT"
    if argument.type != "STRING":
        option["help"] += f" (default: {argument.default:.6g})" if argument.type == "FLOAT" else f" (default: {argument.default})"
    parser.add_argument("--" + name.replace("_", "-"), **option)


def number_within(argument):
    """A converter that refuses numbers out of the argument's bounds; Blender itself would clamp them silently."""
    low, high = argument.hard_min, argument.hard_max
    bounds = f"from {low:g} to {high:g}" if high < UNBOUNDED else f"from {low:g} upward"
    words = {word: int(value) for value, word in WORD.findall(argument.description)}

    def convert(text: str) -> float:
        if text in words:
            return words[text]
        try:
            value = int(text) if argument.type == "INT" else float(text)
        except ValueError:
            value = None
        if value is None or not low <= value <= high:
            raise argparse.ArgumentTypeError(f"'{text}' is not {''.join(f'{word} or ' for word in words)}a number {bounds}")
        return value

    return convert


def png_path(text: str) -> str:
    """Refuses another extension before the run: the picture is always a PNG."""
    if not text.lower().endswith(".png"):
        raise argparse.ArgumentTypeError(f"'{text}' does not end in .png, the only format of this picture")
    return text


def describe_choices(items) -> str:
    """The choices with their descriptions."""
    return "; ".join(f"{item.identifier}: {item.description}" for item in items).replace("%", "%%")
