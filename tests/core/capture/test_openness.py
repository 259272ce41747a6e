import numpy as np
import pytest
import trimesh

from refmesh_addon.core.capture.cleaning import cleaned
from refmesh_addon.core.capture.diagnosis import FrameStatistics, diagnose
from refmesh_addon.core.capture.openness import openness
from refmesh_addon.core.types import TriangleMesh

BALL = trimesh.creation.icosphere(subdivisions=3)


def part_above(height):
    return TriangleMesh(BALL.vertices, BALL.faces[BALL.triangles_center[:, 2] > height])


def sheet():
    x, y = np.meshgrid(np.linspace(0, 1, 20), np.linspace(0, 1, 20))
    corner = (np.arange(19)[:, None] * 20 + np.arange(19)).ravel()
    triangles = np.concatenate([np.column_stack([corner, corner + 1, corner + 21]), np.column_stack([corner, corner + 21, corner + 20])])
    return TriangleMesh(np.column_stack([x.ravel(), y.ravel(), 0.05 * np.sin(5 * x.ravel())]), triangles)


@pytest.mark.parametrize(
    ("mesh", "is_open"), [(part_above(-2), False), (part_above(-0.9), False), (part_above(0.0), True), (sheet(), True)]
)
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_sheets_and_halves_are_open_in_every_scale_and_bodies_with_a_hole_are_not(mesh, is_open, scale):
    statistics = cleaned(TriangleMesh(scale * mesh.vertices, mesh.triangles)).statistics
    assert bool(openness(statistics.capped, statistics.compactness)) == is_open


def test_half_a_ball_misses_a_third_of_its_closed_surface_and_a_ball_is_compact():
    half, ball = cleaned(part_above(0.0)).statistics, cleaned(part_above(-2)).statistics
    assert half.capped == pytest.approx(1 / 3, abs=0.05)
    assert (ball.capped, ball.compactness) == (0.0, pytest.approx(1.0, abs=0.03))


def test_a_thin_shell_is_said_to_be_like_a_sheet():
    shell = trimesh.creation.box(extents=(1, 1, 0.01))
    statistics = cleaned(TriangleMesh(shell.vertices, shell.faces)).statistics
    assert "hardly any volume" in openness(statistics.capped, statistics.compactness)


def test_the_check_tells_the_kind_of_an_open_take_once_and_names_frames_of_another_kind():
    frames = [FrameStatistics(number, content=str(number), capped=0.3 + 0.01 * number) for number in range(6)]
    (finding,) = [one for one in diagnose(frames) if one.kind in ("surface", "open")]
    assert (finding.severity, finding.frame) == ("note", 0)
    assert "open surfaces" in finding.message and "6 of 6 frames" in finding.message
    usual, other = [one for one in diagnose([*frames, FrameStatistics(6, content="6")]) if one.kind in ("surface", "open")]
    assert "6 of 7 frames" in usual.message and other.frame == 6 and "is closed" in other.message


def test_frames_without_volume_in_a_closed_take_are_warned_of():
    frames = [FrameStatistics(number, content=str(number), capped=0.3 + 0.01 * number) for number in range(6)]
    (finding,) = [one for one in diagnose(frames, surface="closed") if one.kind == "open"]
    assert (finding.severity, finding.frame) == ("warning", 5)
    assert "35% of its surface is a guess" in finding.message and "in 6 of 6 frames" in finding.message
    closed = [FrameStatistics(number, content=str(number)) for number in range(6, 20)]
    assert [one.frame for one in diagnose(frames[:2] + closed) if one.kind == "open"] == [0, 1]
