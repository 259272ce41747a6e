"""A body that a few frames show appears in these frames and nowhere else, in both ways of dividing a take."""

import numpy as np
import pytest
import trimesh

from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.pc2 import read_pc2

from .running import cache_entries, finish, remade, report, results

SHOWN = 2


@pytest.fixture(scope="module", params=[0.2, 0.5], ids=["small", "an eighth of the volume"])
def visited(request, tmp_path_factory):
    """Five frames of a ball, and in one of them a second ball of this radius beside it."""
    folder = tmp_path_factory.mktemp("visited")
    for number in range(5):
        bodies = [trimesh.creation.icosphere(subdivisions=3).apply_translation([0.02 * number, 0, 0])]
        if number == SHOWN:
            bodies.append(trimesh.creation.icosphere(subdivisions=2, radius=request.param).apply_translation([2.5, 0.3, 0]))
        trimesh.util.concatenate(bodies).export(folder / f"visited_{number}.obj")
    return folder


@pytest.mark.parametrize("segments", ["long", "groups"])
def test_it_is_shown_as_captured_where_it_is_and_nowhere_else(visited, tmp_path, segments):
    warnings = finish(visited, tmp_path, segments=segments, group_size=5)
    (group,) = report(tmp_path)["groups"]
    assert group["frames"] == [0, 1, 2, 3, 4] and not report(tmp_path)["far_places"]
    meshes = [read_mesh(tmp_path / frame["deformed"]) for frame in report(tmp_path)["frames"]]
    assert [mesh.vertices[:, 0].max() > 2 for mesh in meshes] == [number == SHOWN for number in range(5)]
    source = read_mesh(visited / f"visited_{SHOWN}.obj").vertices
    right = lambda vertices: np.unique(vertices[vertices[:, 0] > 1.7], axis=0)
    np.testing.assert_allclose(right(meshes[SHOWN].vertices), right(source), atol=1e-6)
    assert all(np.array_equal(mesh.triangles, meshes[0].triangles) for mesh in meshes)
    played = list(read_pc2(tmp_path / group["playback"]))
    assert [frame[:, 0].max() > 2 for frame in played] == [number == SHOWN for number in range(5)]
    (entry,) = report(tmp_path)["transients"]
    assert entry["frame"] == SHOWN and entry["shown"] and entry["count"] == 1
    np.testing.assert_allclose(entry["position"], [2.5, 0.3, 0.0], atol=0.01)
    assert any(line.startswith(f"frame {SHOWN}: pieces") for line in warnings)


def test_a_second_run_computes_nothing(visited, tmp_path):
    finish(visited, tmp_path)
    before, first = cache_entries(tmp_path), results(tmp_path)
    finish(visited, tmp_path)
    assert not remade(before, cache_entries(tmp_path)) and results(tmp_path) == first


def test_a_mesh_of_the_users_keeps_its_vertices_and_the_report_says_what_it_lacks(visited, tmp_path):
    mesh = tmp_path / "own.obj"
    trimesh.creation.icosphere(subdivisions=3).export(mesh)
    warnings = finish(visited, tmp_path / "out", mesh=str(mesh))
    assert report(tmp_path / "out")["groups"][0]["triangles"] == 1280
    assert not report(tmp_path / "out")["transients"][0]["shown"]
    assert {place["kind"] for place in report(tmp_path / "out")["far_places"]} == {"missing"}
    assert any("left out" in line for line in warnings)


def test_the_check_names_them(visited, tmp_path):
    finish(visited, tmp_path, until="sequence")
    assert f"frame {SHOWN}: 1 pieces are there for a few frames only" in (tmp_path / "sequence_check.txt").read_text()
