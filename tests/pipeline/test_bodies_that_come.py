"""A body that comes in the middle of a take: centers of its own, another mesh, and nothing of it before."""

import numpy as np
import pytest
import trimesh

from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.result_arrays import read_centers

from .running import cache_entries, finish, remade, report

FIRST = 3


@pytest.fixture(scope="module", params=[False, True], ids=["comes", "leaves"])
def take(request, tmp_path_factory):
    """Six frames of a ball; a second one, of an eighth of its volume, comes with the fourth, or leaves after the third."""
    folder = tmp_path_factory.mktemp("take")
    for number in range(6):
        bodies = [trimesh.creation.icosphere(subdivisions=3).apply_translation([0.02 * number, 0, 0])]
        if (number >= FIRST) != request.param:
            bodies.append(trimesh.creation.icosphere(subdivisions=2, radius=0.5).apply_translation([2.5, 0.05 * number, 0]))
        trimesh.util.concatenate(bodies).export(folder / f"take_{number}.obj")
    return folder, request.param


@pytest.mark.parametrize("segments, group_size", [("long", 5), ("groups", 6), ("groups", 0)])
def test_it_has_centers_and_a_mesh_where_it_is_and_nothing_elsewhere(take, tmp_path, segments, group_size):
    folder, leaves = take
    warnings = finish(folder, tmp_path, segments=segments, group_size=group_size)
    assert [group["frames"] for group in report(tmp_path)["groups"]] == [[0, 1, 2], [3, 4, 5]]
    assert [group["components"] for group in report(tmp_path)["groups"]] == ([2, 1] if leaves else [1, 2])
    assert not report(tmp_path)["far_places"]
    for frame in report(tmp_path)["frames"]:
        shown = read_mesh(tmp_path / frame["deformed"]).vertices[:, 0].max() > 2
        assert shown == ((frame["number"] >= FIRST) != leaves)
        assert frame["source_to_deformed"]["p99"] < 0.01
    changes = report(tmp_path)["tracking"]["retired" if leaves else "born"]
    assert [bool(count) for count in changes] == [number == FIRST for number in range(6)]
    assert any(line.startswith(f"frame {FIRST}: a body {'is missing' if leaves else 'has appeared'}") for line in warnings)
    centers = read_centers(tmp_path)  # as Blender reads them
    without = centers[f"group_{'001' if leaves else '000'}_center_indices"]
    assert 0 < len(without) < centers["positions"].shape[1] and np.isfinite(centers["positions"]).all()


def test_a_second_run_computes_nothing(take, tmp_path):
    finish(take[0], tmp_path)
    before = cache_entries(tmp_path)
    finish(take[0], tmp_path)
    assert not remade(before, cache_entries(tmp_path))
