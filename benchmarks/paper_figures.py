"""The paper's figures, of its pipeline and of ours: python -m benchmarks.paper_figures INPUT [--first 6]

Distance against group size, for several numbers of centers: the group begins at the first frame, and all sizes share one
tracking. `paper` maps by splines and carries the reference mesh back by them, `ours` tears and carries by rigid motions; both
are measured as the centers alone carry the mesh, which is what the paper's figure shows. Writes FOLDER/distances.csv,
FOLDER/distances.png and a picture of source frames and reference meshes, FOLDER/references.png.
"""

from __future__ import annotations

import argparse
import csv
import json
from pathlib import Path

import numpy as np

from refmesh_addon.core.settings import ReferenceSettings, TrackingSettings
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.discovery import find_sequence
from refmesh_addon.pipeline.session.parallel import Workers

from .grouped import Reference, Take, extracted, judged, processes, tracked_take

PIPELINES = {"ours": ReferenceSettings(), "paper": ReferenceSettings(mapping="rbf", least_overlap=0.0)}
MARKS = {500: "o", 1000: "s", 1500: "^"}  # as in the paper
REPORTED = (
    "source_to_deformed_mean",
    "source_to_deformed_p99",
    "source_to_deformed_max",
    "deformed_to_source_mean",
    "deformed_to_source_max",
)
SHOWN = 3  # source frames in the picture: first, middle and last
PIXELS = 1800  # width of the picture
TURN = (1.37, 0.0, 0.45)  # radians about x, y and z, as the preview looks


def main() -> None:
    """Measures, writes the files and prints one line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("input", help="folder, file or pattern")
    parser.add_argument("--first", type=int, help="number of the frame that all groups begin with (default: the first one)")
    parser.add_argument("--sizes", type=int, nargs="+", default=list(range(2, 11)), help="frames of a group (default: 2 to 10)")
    parser.add_argument("--centers", type=int, nargs="+", default=[500, 1000, 1500])
    parser.add_argument("--resolution", type=int, default=256, help="voxels along the longest side (default: %(default)s)")
    parser.add_argument("--folder", type=Path, default=Path("build/paper_figures"), help="where files go (default: %(default)s)")
    arguments = parser.parse_args()
    numbers = [number for number in find_sequence(arguments.input).numbers if arguments.first is None or number >= arguments.first]
    sizes = [size for size in sorted(arguments.sizes) if size <= len(numbers)]
    if not sizes:
        parser.error(f"there are only {len(numbers)} frames from there on")
    frames = ",".join(str(number) for number in numbers[: sizes[-1]])
    arguments.folder.mkdir(parents=True, exist_ok=True)
    rows, shown = [], {}
    with processes() as workers:
        for centers in arguments.centers:
            take = tracked_take(arguments.input, frames, TrackingSettings(centers=centers, resolution=arguments.resolution))
            for size in sizes:
                for name, settings in PIPELINES.items():
                    part = take.part(list(range(size)))
                    shown[name] = (part, extracted(part, settings, workers))
                    rows.append({"pipeline": name, "centers": centers, "size": size, **measured(*shown[name], workers)})
                    print("  ".join(f"{key} {value}" for key, value in rows[-1].items()), flush=True)
    write_table(arguments.folder / "distances.csv", rows)
    plot(arguments.folder / "distances.png", rows, Path(arguments.input).name)
    picture(arguments.folder / "references.png", {name: reference.mesh for name, (_, reference) in shown.items()}, part)
    print(json.dumps({"benchmark": "paper_figures", "input": Path(arguments.input).name, "frames": frames, "rows": rows}))


def measured(take: Take, reference: Reference, workers: Workers) -> dict[str, float]:
    """Distances of the carried mesh, %, over all frames of the group, and the worst IoU."""
    found = judged(take, reference, None, workers)["carried"]
    return {name: found[name] for name in REPORTED} | {"iou": round(min(reference.after), 3)}


def write_table(path: Path, rows: list[dict]) -> None:
    """The rows as CSV."""
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, rows[0])
        table.writeheader()
        table.writerows(rows)


def plot(path: Path, rows: list[dict], title: str) -> None:
    """Distance over group size: mean and Hausdorff, a line for each pipeline and number of centers."""
    from matplotlib.figure import Figure  # drawn without a window, and only in this process

    figure = Figure(figsize=(11, 4.5), layout="constrained")
    for axes, name, words in zip(figure.subplots(1, 2), ("source_to_deformed_mean", "source_to_deformed_max"), ("mean", "Hausdorff")):
        for pipeline, line in (("ours", "-"), ("paper", "--")):
            for centers in sorted({row["centers"] for row in rows}):
                found = [row for row in rows if (row["pipeline"], row["centers"]) == (pipeline, centers)]
                axes.plot(
                    [row["size"] for row in found], [row[name] for row in found], line, marker=MARKS.get(centers, "."),
                    label=f"{pipeline}, {centers} centers",
                )  # fmt: skip
        axes.set(xlabel="frames in the group", ylabel=f"{words} distance, % of the diagonal", title=title, ylim=(0, None))
    axes.legend()
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
        for (words, mesh, color), place in zip(actors, places):
            low, size = place.min(axis=0), np.ptp(place, axis=0)
            data = bpy.data.meshes.new("RefMesh figure")
            fill_mesh(data, TriangleMesh(place - low + [left, 0.0, -size[2] / 2], mesh.triangles))
            data.materials.append(plain_material(f"RefMesh {color}", color))
            add(scene, words, data)
            line = 0.05 * size[0]
            write(scene, words, (left + size[0] / 2, -line), 2 * line)
            left, high, deep = left + size[0] + gap, max(high, size[1]), max(deep, size[2])
        render(scene, np.array([-gap, -5 * line, -deep]), np.array([left, high + gap, deep]), path, PIXELS)


if __name__ == "__main__":
    main()
