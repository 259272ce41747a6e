"""The committed textured sample: every frame is read in color, and shows the colors of its material."""

import re

import numpy as np
import pytest

from refmesh_addon.core.color.exposure import gain_between
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.appearance import parse_appearance
from sample_scenes.generators.textured import EXPOSURE_SWING, TEXTURED
from sample_scenes.textured_grasp.generate import FIRST_NUMBER, FOLDER, FRAMES, SIZE

PATHS = sorted(FOLDER.glob("*.obj"))


def test_all_frames_are_there():
    assert len(PATHS) == FRAMES
    assert all(path.with_suffix(end).is_file() for path in PATHS for end in (".mtl", ".jpg"))


@pytest.mark.parametrize("path", PATHS[::4], ids=lambda path: path.stem)
def test_frame_shows_the_colors_of_its_material(path):
    appearance, notes, _ = parse_appearance(path.read_bytes(), path)
    assert notes == () and appearance.size == SIZE
    mesh: TriangleMesh = appearance.mesh
    moment = (int(re.search("[0-9]+", path.stem)[0]) - FIRST_NUMBER) / (FRAMES - 1)
    middles = mesh.vertices[mesh.triangles].mean(axis=1)
    truth = TEXTURED["grasp"]().color(middles, moment)
    shown = appearance.at(np.arange(len(middles)), np.full((len(middles), 2), 1 / 3, np.float32))
    gain = gain_between(shown.astype(np.uint8), truth, np.ones(len(truth), bool))
    assert np.abs(gain - 1).max() < EXPOSURE_SWING + 0.05
    assert np.median(np.abs(shown - truth)) < 15
