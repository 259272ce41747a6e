"""Global optimization of a take in which a body appears: the frames before and after are optimized each with the centers they have."""

import numpy as np
import pytest
import trimesh

from ..running import finish, report

COUNT, COMES = 6, 2


@pytest.fixture(scope="module")
def late(tmp_path_factory):
    """Folder of frames of a ball that moves, and a second one from the middle on."""
    folder, rng = tmp_path_factory.mktemp("late"), np.random.default_rng(0)
    for number in range(1, COUNT + 1):
        parts = []
        for place in [[0.05 * number, 0, 0], [3.0, 0.03 * number, 0]][: 1 + (number > COMES)]:
            ball = trimesh.creation.icosphere(subdivisions=2)
            ball.apply_transform(trimesh.transformations.random_rotation_matrix(rng.random(3)))
            parts.append(ball.apply_translation(place))
        trimesh.util.concatenate(parts).export(folder / f"late_{number:03d}.obj")
    return folder


def test_centers_that_are_born_are_optimized_from_then_on(late, tmp_path):
    settings = {"until": "tracking", "centers": 24, "resolution": 24}
    finish(late, tmp_path, **settings)
    forward = np.load(tmp_path / "centers.npz")["positions"]
    warnings = finish(late, tmp_path, global_rounds=1, **settings)
    optimized = np.load(tmp_path / "centers.npz")["positions"]
    assert not [line for line in warnings if "left out" in line]
    figures = report(tmp_path)["tracking"]
    (energies,) = figures["global_energies"]
    assert (np.diff(energies) <= 0).all() and energies[-1] < energies[0]
    born = np.flatnonzero(optimized[0, :, 0] > 1.9)
    assert len(figures["dfu"]) == COUNT and 18 < len(born) < 30
    np.testing.assert_array_equal(optimized[:COMES, born], forward[:COMES, born])
    assert np.abs(optimized[COMES:, born] - forward[COMES:, born]).max() > 1e-3
    assert (np.linalg.norm(optimized[-1, born] - [3.0, 0.03 * COUNT, 0], axis=1) < 1.0).all()
