"""Layouts and bakes on a textured sequence whose colors are known.

    python -m benchmarks.color [--frames 12] [--size 1024] [--source FOLDER] [--set name=value]

The hand and ball of `sample_scenes`, each frame with a mesh, an atlas, an exposure and noise of its own, or a capture on disk. Seconds
are of one core.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

import numpy as np

from refmesh_addon.core.color.bake import Capture, baked_sharp, placed
from refmesh_addon.core.color.frame import oriented, textured
from refmesh_addon.core.color.layout import Layout, measured
from refmesh_addon.core.color.projected_layout import projected_layout
from refmesh_addon.core.color.texels import Texels
from refmesh_addon.core.color.unlit import eight_views, picture_error
from refmesh_addon.core.geometry.mesh import triangle_normals
from refmesh_addon.core.settings import Settings, flat_fields
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.appearance import parse_appearance
from refmesh_addon.io.images import encoded
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.report import read_report
from refmesh_addon.pipeline.run import run
from refmesh_addon.pipeline.session.job import JobSpec
from refmesh_addon.pipeline.session.layouts import best_layout
from sample_scenes.generators.textured import TEXTURED, TexturedSequence, write_frame

from .common import assignment

PICTURE_SIZE = 512


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=12)
    parser.add_argument("--size", type=int, default=1024, help="texels along a side, of the source's atlases and of the result")
    parser.add_argument("--source", type=Path, help="a capture in place of the generated sequence")
    parser.add_argument("--output", type=Path, help="folder for the run, kept and taken up again")
    setting = assignment(flat_fields())
    parser.add_argument("--set", type=setting, action="append", default=[], metavar="NAME=VALUE", help="a setting of the run")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = arguments.output or Path(scratch)
        source = arguments.source or generate(TEXTURED["grasp"](), folder / "frames", arguments.frames, arguments.size)
        settings = Settings.from_flat({"resolution": 128, "texture": "off", **dict(arguments.set)})
        run(JobSpec(str(source), str(folder / "out"), settings=settings), lambda *progress: None, print)
        print(json.dumps(figures(source, folder / "out", arguments.size)))


def generate(sequence: TexturedSequence, folder: Path, count: int, size: int) -> Path:
    """The frames on disk, made where they are not there yet."""
    folder.mkdir(parents=True, exist_ok=True)
    for index, moment in enumerate(np.linspace(0.0, 1.0, count)):
        if not (folder / f"frame_{index:04d}.obj").exists():
            write_frame(folder, f"frame_{index:04d}", sequence.frame(moment, index, size))
    return folder


def figures(source: Path, output: Path, size: int) -> dict[str, object]:
    """Of layouts and bakes, over all groups of a finished run."""
    report, rows, layouts = read_report(output), [], []
    files = dict(zip(report["sequence"]["numbers"], report["sequence"]["files"]))
    for group in report["groups"]:
        reference = read_mesh(output / group["reference"])
        layout, entry = layout_figures(reference)
        layouts.append(entry)
        meshes = {number: read_mesh(output / f"deformed/frame_{number:04d}.ply") for number in group["frames"]}
        paths = {number: Path(source) / files[number] for number in group["frames"]}
        rows += [bake_figures(meshes[number], layout, paths[number], size) for number in group["frames"]]
        print(json.dumps({"group": group["index"], **entry, **mean_of(rows)}), flush=True)
    return {"size": size, **mean_of(layouts), **mean_of(rows)}


def layout_figures(mesh: TriangleMesh) -> tuple[Layout, dict[str, float]]:
    """The layout that a job takes, beside the plain projection."""
    start = time.perf_counter()
    layout, _ = best_layout(mesh)
    seconds = time.perf_counter() - start
    plain, quality = measured(mesh, projected_layout(mesh)), measured(mesh, layout)
    entry = {"charts": quality.charts, "stretch": quality.stretch, "area": quality.area_used, "layout_s": seconds}
    entry |= {"plain_charts": plain.charts, "plain_stretch": plain.stretch, "plain_area": plain.area_used}
    return layout, entry


def bake_figures(deformed: TriangleMesh, layout: Layout, path: Path, size: int) -> dict[str, float]:
    """One frame, by walks and by a search for every texel; the texels are worked out beforehand, as for all frames of a group."""
    texels = Texels.of(layout, size)
    start = time.process_time()
    appearance = parse_appearance(path.read_bytes(), path)[0]
    read = time.process_time()
    capture = Capture(oriented(appearance, read_mesh(path)).mesh)
    places = placed(deformed, texels, capture)
    colors = baked_sharp(appearance, places, texels)
    done = time.process_time()
    image = texels.image(colors)
    encoded(image, ".png")
    written = time.process_time()
    searched = capture.searched(texels.points(deformed), triangle_normals(deformed)[texels.triangles])
    plain = time.process_time() - written
    apart = np.linalg.norm(capture.at(places) - capture.at(searched), axis=1) / deformed.diagonal
    error = picture_error(appearance, textured(deformed, layout, image), PICTURE_SIZE, eight_views())
    seconds = {"read_s": read - start, "bake_s": done - read, "write_s": written - done, "plain_bake_s": plain}
    return {**seconds, "walk_differs": float((apart > 1e-4).mean()), **{f"{name}": value for name, value in vars(error).items()}}


def mean_of(rows: list[dict[str, float]]) -> dict[str, float]:
    """Mean of every figure, to four digits."""
    return {name: float(f"{np.mean([row[name] for row in rows if name in row]):.4g}") for name in (rows[0] if rows else {})}


if __name__ == "__main__":
    main()
