"""A sequence small enough to run the whole pipeline on in seconds."""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh

from refmesh_addon.core.settings import Settings
from refmesh_addon.pipeline.session.blender_program import BLENDER

os.environ[BLENDER] = ""  # a second or two for each layout; tests that need it take this back
FRAMES = (3, 4, 5)
TINY = Settings.from_flat(
    {"segments": "groups", "group_size": 3, "centers": 50, "resolution": 32, "alignment_steps": 1, "triangles": 640}
    | {"fit_rounds": 1, "samples": 1000}
)


@pytest.fixture(scope="session")
def two_balls(tmp_path_factory):
    """Folder of three OBJ frames: two balls that come closer, with other vertices in each frame."""
    folder = tmp_path_factory.mktemp("two_balls")
    rng = np.random.default_rng(0)
    for step, number in enumerate(FRAMES):
        balls = []
        for side in (-1, 1):
            ball = trimesh.creation.icosphere(subdivisions=2)
            ball.apply_transform(trimesh.transformations.random_rotation_matrix(rng.random(3)))
            balls.append(ball.apply_translation([side * (1.5 - 0.1 * step), 0, 0]))
        trimesh.util.concatenate(balls).export(folder / f"balls_{number:03d}.obj")
    return folder


@pytest.fixture(scope="session")
def finished(two_balls, tmp_path_factory):
    """Output folder of a whole run on the two balls, not to be changed."""
    from .running import finish

    output = tmp_path_factory.mktemp("finished")
    finish(two_balls, output)
    return output


@pytest.fixture
def output(finished, tmp_path):
    """A copy of that folder, free to be changed."""
    return Path(shutil.copytree(finished, tmp_path / "out"))
