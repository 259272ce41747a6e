"""A mesh of the user's own through the whole pipeline."""

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.geometry.mesh import submesh
from refmesh_addon.core.settings import OVER_REFERENCE
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.ply import write_ply

from .conftest import FRAMES
from .running import cache_entries, finish, remade, report, stages_of


@pytest.fixture
def own(tmp_path):
    """Two open bowls in quads over the balls of frame 4, which leave their far ends out; its first polygon is a quad."""
    around, down = 24, 9
    vertices, faces = [], []
    for side in (-1, 1):
        first = len(vertices)
        for polar in np.linspace(0.15, 2.4, down):
            for angle in np.linspace(0, 2 * np.pi, around, endpoint=False):
                y, z = np.sin(polar) * np.cos(angle), np.sin(polar) * np.sin(angle)
                vertices.append([side * 1.4 - np.cos(polar), y, z])
        for ring in range(down - 1):
            for step in range(around):
                here, beside = first + ring * around + step, first + ring * around + (step + 1) % around
                faces.append([here, beside, beside + around, here + around])
    path = tmp_path / "own.obj"
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices] + ["f " + " ".join(str(index + 1) for index in face) for face in faces]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_it_serves_every_frame_with_its_vertices_in_their_order(two_balls, own, tmp_path):
    output = tmp_path / "out"
    finish(two_balls, output, mesh=str(own), mesh_frame=4, group_size=1)
    (group,) = report(output)["groups"]
    mesh = read_mesh(own)
    assert group["frames"] == list(FRAMES)
    for frame in report(output)["frames"]:
        deformed = read_mesh(output / frame["deformed"])
        assert_array_equal(deformed.triangles, mesh.triangles)
        assert frame["deformed_to_source"]["mean"] < 0.005, "it lies on the capture"
        assert frame["source_to_deformed"]["max"] > 0.02, "what it leaves out is measured"
    at_home = read_mesh(output / report(output)["frames"][1]["deformed"])
    assert np.linalg.norm(at_home.vertices - mesh.vertices, axis=1).max() < 0.2


def test_a_mesh_made_over_the_reference_mesh_serves_as_one_made_over_a_frame(two_balls, own, tmp_path):
    output, path = tmp_path / "out", tmp_path / "mine.ply"
    finish(two_balls, output, segments="frames")
    (group,) = report(output)["groups"]
    reconstructed = read_mesh(output / group["reference"])
    mesh, _ = submesh(reconstructed, reconstructed.vertices[reconstructed.triangles].mean(axis=1)[:, 2] > 0)
    write_ply(path, mesh)
    finish(two_balls, output, mesh=str(path), mesh_frame=OVER_REFERENCE)
    (group,) = report(output)["groups"]
    assert_allclose(read_mesh(output / group["reference"]).vertices, mesh.vertices, atol=1e-5)
    for frame in report(output)["frames"]:
        assert_array_equal(read_mesh(output / frame["deformed"]).triangles, mesh.triangles)
        assert frame["deformed_to_source"]["mean"] < 0.005
    write_ply(path, mesh.moved(mesh.vertices + [0, 0, 1.0]))
    with pytest.raises(RefMeshError, match="away from the reference positions of these frames"):
        finish(two_balls, output, mesh=str(path), mesh_frame=OVER_REFERENCE)


def test_another_mesh_is_carried_without_tracking_or_aligning_anew(two_balls, own, tmp_path):
    output = tmp_path / "out"
    finish(two_balls, output, segments="frames")
    before = cache_entries(output)
    finish(two_balls, output, mesh=str(own), mesh_frame=4)
    assert "tracking" not in stages_of(remade(before, cache_entries(output)))


def test_what_cannot_be_taken_is_refused_before_any_work(two_balls, own, tmp_path):
    with pytest.raises(RefMeshError, match="--mesh-frame 9 is not part of the job; it has frames 3-5"):
        finish(two_balls, tmp_path / "out", mesh=str(own), mesh_frame=9)
    with pytest.raises(RefMeshError, match="--tracking sequence"):
        finish(two_balls, tmp_path / "out", mesh=str(own), mesh_frame=4, tracking="group")
    large = tmp_path / "large.obj"
    trimesh.load(own, process=False).apply_scale(1000).export(large)
    with pytest.raises(RefMeshError, match="large.obj, over frame 3: it is .* times as large"):
        finish(two_balls, tmp_path / "out", mesh=str(large))
    with pytest.raises(RefMeshError, match="nowhere.obj: cannot be read"):
        finish(two_balls, tmp_path / "out", mesh=str(tmp_path / "nowhere.obj"))
    assert not list((tmp_path / "out" / "cache").glob("tracking/*"))
