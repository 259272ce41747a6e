"""The paper's figure, of its pipeline and of ours: python -m benchmarks.paper_figures INPUT [--first 6]

Distance against group size, for several numbers of centers. All sizes share one tracking; a group begins at the frame given, or
earlier where the sequence ends too soon. `paper` is what `--preset paper` does: it maps by splines, reconstructs by PyMeshLab and
carries the reference mesh back by splines. `unaligned` is the same without the alignment of the frames. As in the paper's
figure the mesh is carried by its centers alone; with --deformed the whole deformation of each pipeline is measured as well.
Writes FOLDER/distances.csv, FOLDER/distances.png and a picture of source frames and reference meshes, FOLDER/references.png.
Rows that distances.csv already has are kept: an interrupted run goes on, and another one may add numbers of centers.
"""

from __future__ import annotations

import argparse
import csv
import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from refmesh_addon.core.presets import PRESETS
from refmesh_addon.core.settings import Settings, TrackingSettings
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.discovery import find_sequence
from refmesh_addon.pipeline.session.parallel import Workers

from .grouped import Reference, Take, extracted, judged, processes, tracked_take

OURS, PAPER = Settings(), Settings.from_flat(PRESETS["paper"])
PIPELINES = {"ours": OURS, "paper": PAPER, "unaligned": replace(PAPER, reference=replace(PAPER.reference, alignment_steps=0))}
LINES = {"ours": "-", "paper": "--", "unaligned": ":"}
MARKERS = {500: "o", 1000: "s", 1500: "^"}  # as in the paper
COLORS = {500: "tab:blue", 1000: "tab:orange", 1500: "tab:green"}
DISTANCES = ("source_to_deformed_mean", "source_to_deformed_p99", "source_to_deformed_max")
FIGURES = (*DISTANCES, "deformed_to_source_mean", "deformed_to_source_max")
TABLE = "distances.csv"
SHOWN = 3  # source frames in the picture: first, middle and last
PIXELS = 1800  # width of the picture
TURN = (1.37, 0.0, 0.45)  # radians about x, y and z, as in the preview


@dataclass(frozen=True)
class Groups:
    """Groups of several sizes in one take.

    numbers : of the frames that are tracked.  first : index of the one that groups begin with, unless too few follow it.
    """

    numbers: tuple[int, ...]
    first: int

    @classmethod
    def of(cls, numbers: tuple[int, ...], first: int, largest: int) -> Groups:
        """Groups of up to `largest` frames in a sequence, from the frame of that index on."""
        begin = min(first, len(numbers) - largest)
        return cls(numbers[begin : max(begin + largest, first + 1)], first - begin)

    def frames(self, size: int) -> list[int]:
        """Indices of the frames of the group of that size."""
        start = min(self.first, len(self.numbers) - size)
        return list(range(start, start + size))


def main() -> None:
    """Measures, writes the files and prints one line of JSON."""
    arguments = parsed_arguments()
    numbers = find_sequence(arguments.input).numbers
    sizes = [size for size in sorted(set(arguments.sizes)) if size <= len(numbers)]
    groups = Groups.of(numbers, 0 if arguments.first is None else numbers.index(arguments.first), sizes[-1])
    arguments.folder.mkdir(parents=True, exist_ok=True)
    rows = read_table(arguments.folder / TABLE)
    with processes() as workers:
        for centers in arguments.centers:
            known = {(row["centers"], row["size"]) for row in rows}
            measure_sizes(arguments, groups, centers, [size for size in sizes if (centers, size) not in known], rows, workers)
    plot(arguments.folder / "distances.png", rows, Path(arguments.input).name)
    print(json.dumps({"benchmark": "paper_figures", "input": Path(arguments.input).name, "rows": rows}))


def measure_sizes(
    arguments: argparse.Namespace, groups: Groups, centers: int, sizes: list[int], rows: list[dict], workers: Workers
) -> None:
    """Adds the rows of a number of centers, and writes the table after each size; then draws the reference meshes of the last one."""
    if not sizes:
        return
    settings = TrackingSettings(centers=centers, resolution=arguments.resolution)
    take = tracked_take(arguments.input, ",".join(map(str, groups.numbers)), settings)
    for size in sizes:
        group = take.part(groups.frames(size))
        references = {name: extracted(group, pipeline.reference, workers) for name, pipeline in PIPELINES.items()}
        for name, reference in references.items():
            figures = measured(group, reference, PIPELINES[name] if size in arguments.deformed else None, workers)
            rows.append({"pipeline": name, "centers": centers, "first": group.numbers[0], "size": size, **figures})
            print("  ".join(f"{key} {value}" for key, value in rows[-1].items()), flush=True)
        write_table(arguments.folder / TABLE, rows)
    picture(arguments.folder / "references.png", {name: reference.mesh for name, reference in references.items()}, group)


def parsed_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("input", help="folder, file or pattern")
    parser.add_argument("--first", type=int, help="number of the frame that groups begin with (default: the first one)")
    parser.add_argument("--sizes", type=int, nargs="+", default=list(range(2, 11)), help="frames of a group (default: 2 to 10)")
    parser.add_argument(
        "--deformed", type=int, nargs="*", default=[], metavar="SIZE", help="sizes of which the deformation is measured, too"
    )
    parser.add_argument("--centers", type=int, nargs="+", default=[500, 1000, 1500])
    parser.add_argument("--resolution", type=int, default=256, help="voxels along the longest side (default: %(default)s)")
    parser.add_argument("--folder", type=Path, default=Path("build/paper_figures"), help="where files go (default: %(default)s)")
    arguments = parser.parse_args()
    numbers = find_sequence(arguments.input).numbers
    if arguments.first is not None and arguments.first not in numbers:
        parser.error(f"--first {arguments.first}: there is no such frame; the first is {numbers[0]}, the last {numbers[-1]}")
    if min(arguments.sizes) < 1 or min(arguments.sizes) > len(numbers):
        parser.error(f"--sizes: there are {len(numbers)} frames, so a group has 1 to {len(numbers)}")
    return arguments


def measured(group: Take, reference: Reference, pipeline: Settings | None, workers: Workers) -> dict[str, float | str]:
    """Distances of the mesh over all frames of the group, in % of the diagonal, and the worst IoU.

    pipeline : whose deformation is measured as well; None leaves those columns empty.
    """
    distances = judged(group, reference, pipeline and pipeline.deformation, workers)
    carried = {name: distances["carried"][name] for name in FIGURES}
    deformed = {f"fitted_{name}": distances["fitted"][name] if pipeline else "" for name in DISTANCES}
    return carried | deformed | {"iou": round(min(reference.after), 3)}


def read_table(path: Path) -> list[dict]:
    """The rows of an earlier run, none where there was none."""
    if not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return [
            {name: value if name == "pipeline" or value == "" else json.loads(value) for name, value in row.items()}
            for row in csv.DictReader(file)
        ]


def write_table(path: Path, rows: list[dict]) -> None:
    """The rows as CSV."""
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, rows[0])
        table.writeheader()
        table.writerows(rows)


def line_of(rows: list[dict], pipeline: str, centers: int, name: str) -> list[tuple[int, float]]:
    """Group size and value of one line of the plot, from left to right in whatever order the rows were measured."""
    return sorted((row["size"], row[name]) for row in rows if (row["pipeline"], row["centers"]) == (pipeline, centers))


def plot(path: Path, rows: list[dict], title: str) -> None:
    """Distance over group size: mean and Hausdorff, a line for each pipeline and number of centers."""
    from matplotlib.figure import Figure  # drawn without a window, and only in this process
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    figure = Figure(figsize=(11, 4.5), layout="constrained")
    axes = figure.subplots(1, 2)
    for side, name, label in zip(axes, ("source_to_deformed_mean", "source_to_deformed_max"), ("mean", "Hausdorff")):
        for pipeline, centers in sorted({(row["pipeline"], row["centers"]) for row in rows}):
            line = line_of(rows, pipeline, centers, name)
            style = {"linestyle": LINES[pipeline], "marker": MARKERS.get(centers, "."), "color": COLORS.get(centers)}
            side.plot(*zip(*line), **style, label=f"{pipeline}, {centers} centers")
        side.set(xlabel="frames in the group", ylabel=f"{label} distance, % of the diagonal", title=title, yscale="log")
        side.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        side.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        side.yaxis.set_minor_formatter(NullFormatter())
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside right upper")
    figure.savefig(path, dpi=130)


def picture(path: Path, references: dict[str, TriangleMesh], take: Take) -> None:
    """Some source frames and the reference meshes of the largest group side by side."""
    import bpy
    from mathutils import Euler, Matrix

    from refmesh_addon.bridge.picture.studio import add, render, studio, write
    from refmesh_addon.bridge.scene.materials import REFERENCE_COLOR, SOURCE_COLOR, plain_material
    from refmesh_addon.bridge.scene.meshes import fill_mesh

    picked = sorted({0, len(take.meshes) // 2, len(take.meshes) - 1})[:SHOWN]
    actors = [(f"frame {take.numbers[index]}", take.meshes[index], SOURCE_COLOR) for index in picked]
    actors += [(f"reference, {name}", mesh, REFERENCE_COLOR) for name, mesh in references.items()]
    upright = Matrix.Rotation(np.pi / 2, 3, "X")  # captures stand along y
    turn = np.array(Euler(TURN).to_matrix().transposed() @ upright)
    places = [mesh.vertices @ turn.T for _, mesh, _ in actors]
    gap = 0.15 * max(np.ptp(place[:, 0]) for place in places)
    with studio() as scene:
        left, line, high, deep = 0.0, 0.1 * gap, 0.0, 0.0
        for (label, mesh, color), place in zip(actors, places):
            low, size = place.min(axis=0), np.ptp(place, axis=0)
            data = bpy.data.meshes.new("RefMesh figure")
            fill_mesh(data, TriangleMesh(place - low + [left, 0.0, -size[2] / 2], mesh.triangles))
            data.materials.append(plain_material(f"RefMesh {color}", color))
            add(scene, label, data)
            line = 0.05 * size[0]
            write(scene, label, (left + size[0] / 2, -line), 2 * line)
            left, high, deep = left + size[0] + gap, max(high, size[1]), max(deep, size[2])
        render(scene, np.array([-gap, -5 * line, -deep]), np.array([left, high + gap, deep]), path, PIXELS)


if __name__ == "__main__":
    main()
