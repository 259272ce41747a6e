"""Every reconstruction gives a closed surface through its points; one that is not installed is refused before the work begins."""

import numpy as np
import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.geometry.mesh import is_watertight, sample_surface, triangle_normals
from refmesh_addon.core.reference.frame_features import FrameFeatures
from refmesh_addon.core.reference.group import GroupSurface
from refmesh_addon.core.settings import ReferenceSettings
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.pipeline.stages import meshlab
from refmesh_addon.pipeline.stages.reconstruction import RECONSTRUCTIONS, build_with

from ...core.shapes import ball
from ..running import finish, report


def surface(points, normals):
    no_lines = FrameFeatures(TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3))), np.zeros((0, 2), dtype=np.int32))
    return GroupSurface(points, normals, np.zeros(len(points), dtype=bool), no_lines)



@pytest.fixture
def without_pymeshlab(monkeypatch):
    monkeypatch.setattr(meshlab, "find_spec", lambda name: None)


def test_every_choice_of_the_setting_is_there():
    settings = next(item for item in ReferenceSettings.__dataclass_fields__.values() if item.name == "reconstruction")
    assert list(settings.metadata["choices"]) == list(RECONSTRUCTIONS)


@pytest.mark.parametrize("name", RECONSTRUCTIONS)
def test_a_ball_is_closed_and_round(name):
    if name == meshlab.PACKAGE:
        pytest.importorskip(name)
    sphere = ball(4, 2.0, (10.0, 0.0, 0.0))
    points, owners = sample_surface(sphere, 6000, np.random.default_rng(0))
    built = build_with(name, surface(points, triangle_normals(sphere)[owners]), 0.5, 2000, 6)
    radii = np.linalg.norm(built.mesh.vertices - [10.0, 0.0, 0.0], axis=1)
    assert is_watertight(built.mesh) and built.self_intersections == 0
    assert len(built.mesh.triangles) == pytest.approx(2000, rel=0.01)
    assert np.abs(radii - 2.0).max() < 0.02


def test_the_same_points_give_the_same_bytes():
    pytest.importorskip(meshlab.PACKAGE)
    sphere = ball(3)
    points, owners = sample_surface(sphere, 3000, np.random.default_rng(0))
    first, again = (meshlab.screened_poisson(points, triangle_normals(sphere)[owners], 5) for _ in range(2))
    assert first.vertices.tobytes() == again.vertices.tobytes() and first.triangles.tobytes() == again.triangles.tobytes()


def test_a_missing_package_is_refused_with_what_to_do(without_pymeshlab):
    with pytest.raises(RefMeshError, match=r"'pymeshlab' is not installed; install .* or take --reconstruction builtin"):
        build_with("pymeshlab", surface(np.zeros((4, 3)), np.ones((4, 3))), 1.0, 100, 5)


def test_a_job_is_refused_before_anything_is_tracked(two_balls, tmp_path, without_pymeshlab):
    with pytest.raises(RefMeshError, match="--reconstruction pymeshlab"):
        finish(two_balls, tmp_path, reconstruction="pymeshlab")
    assert not (tmp_path / "cache" / "tracking").exists()
    finish(two_balls, tmp_path, reconstruction="pymeshlab", until="tracking")  # needs no reconstruction


def test_a_job_may_reconstruct_by_pymeshlab(two_balls, tmp_path):
    pytest.importorskip(meshlab.PACKAGE)
    finish(two_balls, tmp_path, reconstruction="pymeshlab")
    found = report(tmp_path)
    assert found["settings"]["reconstruction"] == "pymeshlab" and found["versions"]["pymeshlab"]
    assert found["groups"][0]["watertight"] and found["groups"][0]["components"] == 2
    assert max(frame["source_to_deformed"]["mean"] for frame in found["frames"]) < 0.05
