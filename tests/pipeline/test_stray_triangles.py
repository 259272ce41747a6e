"""One triangle far away changes no figure of a take."""

import json

import numpy as np
import trimesh

from refmesh_addon.core.settings import Settings
from refmesh_addon.pipeline.run import run
from refmesh_addon.pipeline.session.job import JobSpec

from .running import shared_workers

SMALL = {"centers": 32, "resolution": 32, "triangles": 400, "samples": 500, "alignment_steps": 1, "fit_rounds": 1, "texture": "off"}


def figures(folder, stray):
    """Distances of each frame of a ball that moves, and the warnings; stray : corners of one more triangle in frame 1, or None."""
    (folder / "take").mkdir(parents=True)
    for number in range(3):
        ball = trimesh.creation.icosphere(2)
        vertices, faces = ball.vertices * [1, 1.3, 0.8] + [0.05 * number, 0, 0], ball.faces
        if number == 1 and stray is not None:
            vertices, faces = np.vstack([vertices, stray]), np.vstack([faces, len(vertices) + np.arange(3)])
        trimesh.Trimesh(vertices, faces, process=False).export(folder / "take" / f"ball_{number:03d}.ply")
    spec = JobSpec(str(folder / "take"), str(folder / "out"), settings=Settings.from_flat(SMALL))
    warnings = []
    run(spec, lambda *_: None, warnings.append, shared_workers())
    report = json.loads((folder / "out" / "report.json").read_text())
    return [frame["source_to_deformed"] for frame in report["frames"]] + [report["bbox_diagonal"]], warnings


def test_figures_with_a_stray_triangle_are_those_without_and_the_run_names_it(tmp_path):
    clean, _ = figures(tmp_path / "clean", None)
    with_stray, warnings = figures(tmp_path / "stray", 1e5 + np.eye(3))
    assert with_stray == clean and clean[0]["mean"] > 0
    assert any("ball_001.ply: 1 stray triangle is far from everything else, near (1e+05" in warning for warning in warnings)
