"""A ball that rests on a box and hardly leaves it: two bodies, without a neck or a spike where they touch."""

import numpy as np

from refmesh_addon.core.geometry.mesh import vertex_components
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.ply import write_ply
from sample_scenes.generators.shapes import ball, block, union
from sample_scenes.generators.surface import iso_surface

from .running import finish, report

RADIUS, SIDES = 0.5, (1.2, 1.2, 0.6)
HEIGHTS = (0.46, 0.5, 0.57, 0.57, 0.49)  # of the ball's middle above the box; two of five frames show a gap
NEAR = 0.03  # half the edges of the capture


def test_a_narrow_gap_leaves_two_bodies_with_their_true_surfaces(tmp_path):
    for number, height in enumerate(HEIGHTS):
        solid = union(block((0, 0, -0.3), np.divide(SIDES, 2), 0.05), ball((0, 0, height), RADIUS))
        frame = iso_surface(solid, np.array([0, 0, 0.2]), 1.4, 0.06, np.random.default_rng(number))
        write_ply(tmp_path / f"take_{number}.ply", frame)
    warnings = finish(tmp_path, tmp_path / "out", until="reference", segments="long", centers=200, resolution=96, triangles=4000)
    assert any("2 bodies touch in other frames, but are apart in frames 2-3" in line for line in warnings)
    assert [body["frames"] for body in report(tmp_path / "out")["bodies"]] == [[2, 3]] * 2
    mesh = read_mesh(tmp_path / "out" / "reference" / "group_000.ply")
    count, component = vertex_components(mesh)
    parts = sorted((mesh.vertices[component == part] for part in range(count)), key=lambda part: np.ptp(part[:, 0]))
    assert count == 2
    middle = (parts[0].min(axis=0) + parts[0].max(axis=0)) / 2
    assert np.abs(np.linalg.norm(parts[0] - middle, axis=1) - RADIUS).max() < NEAR
    assert np.abs(np.ptp(parts[1], axis=0) - SIDES).max() < NEAR
