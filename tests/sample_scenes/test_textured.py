"""The textured sequence: its colors are those of the material, and its files are read back as they were."""

import numpy as np
import pytest

from refmesh_addon.core.color.exposure import exposed
from refmesh_addon.core.color.texels import Texels
from refmesh_addon.io.appearance import parse_appearance
from sample_scenes.generators.materials import checker, letters, waves
from sample_scenes.generators.textured import NOISE, TEXTURED, write_frame

pytest.importorskip("xatlas")
SIZE = 128


@pytest.fixture(scope="module")
def frame():
    return TEXTURED["grasp"]().frame(0.0, 12, SIZE)


def test_texels_have_the_color_of_their_material_point(frame):
    texels = Texels.of(frame.layout, SIZE)
    truth = exposed(TEXTURED["grasp"]().color(texels.points(frame.mesh), 0.0), frame.gain)
    shown = frame.image.reshape(-1, 3)[texels.pixels]
    assert np.abs(shown.astype(float) - truth).mean() < 1.5 * NOISE


def test_a_material_point_keeps_its_color():
    sequence = TEXTURED["grasp"]()
    points = sequence.sequence.frame(0.0, 1).vertices[::50]
    labels = sequence.sequence.labels(points, 0.0)
    later = sequence.sequence.motion(sequence.sequence.rest(points, labels, 0.0), labels, 0.3)
    same = (sequence.color(points, 0.0) == sequence.color(later, 0.3)).all(axis=1)
    assert same.mean() > 0.97  # all but points that rounding puts across the line of a checker


def test_files_are_read_back(frame, tmp_path):
    write_frame(tmp_path, "grasp_0001", frame)
    path = tmp_path / "grasp_0001.obj"
    appearance, notes, _ = parse_appearance(path.read_bytes(), path)
    assert notes == ()
    assert np.array_equal(appearance.images[0], frame.image)
    np.testing.assert_allclose(appearance.uvs, frame.layout.corners, atol=1e-5)
    np.testing.assert_allclose(appearance.mesh.vertices, frame.mesh.vertices, atol=1e-3)


def test_materials_have_the_colors_that_were_asked_for():
    points = np.random.default_rng(0).uniform(-50, 50, (2000, 3))
    dark, bright = (0.1, 0.2, 0.3), (0.9, 0.8, 0.7)
    assert {tuple(color) for color in checker(7.0, (dark, bright))(points)} == {dark, bright}
    blended = waves(30.0, (dark, bright))(points)
    assert (blended >= 0.1).all() and (blended <= 0.9).all()
    ink = (0.0, 0.0, 1.0)
    written = letters("HE", lambda places: places[:, :2], ink, checker(7.0, (dark, bright)))(points)
    assert 0.1 < (written == ink).all(axis=1).mean() < 0.6
