"""The committed frames of the sample are those that its script writes."""

import numpy as np

from sample_scenes.grasp.generate import DECIMALS, FOLDER, frames


def parse(text: str) -> tuple[np.ndarray, list[str]]:
    lines = text.splitlines()
    vertices = [line.split()[1:] for line in lines if line.startswith("v ")]
    return np.array(vertices, dtype=float), [line for line in lines if line.startswith("f ")]


def test_script_writes_the_committed_frames():
    made = dict(frames())
    assert sorted(made) == sorted(path.name for path in FOLDER.iterdir())
    for name, text in made.items():
        vertices, faces = parse(text)
        committed_vertices, committed_faces = parse((FOLDER / name).read_text())
        assert faces == committed_faces
        # Another processor may round the last written digit the other way.
        assert np.abs(vertices - committed_vertices).max() < 1.5 * 10**-DECIMALS
