"""A body 2,683 kilometers from the origin, as georeferenced scans are: as precise as near it, in the scene and in every file."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.bridge.scene.far_origin import offset_of, place_in_world
from refmesh_addon.bridge.scene.meshes import read_positions
from refmesh_addon.io.meshes import read_mesh
from refmesh_addon.io.pc2 import read_pc2

from .conftest import GROUPS, NUMBERS, place, reference, write_frames, write_results

FAR = (2_683_000.0, 1_247_000.0, 450.0)
PRECISE = 1e-6 * 4.0  # of the diagonal


@pytest.fixture
def far_frames(tmp_path):
    return write_frames(tmp_path / "ball", FAR)


@pytest.fixture(params=["Z", "Y"])
def far_solved(blender, far_frames, tmp_path, request):
    blender.ops.refmesh.import_sequence(filepath=str(far_frames), up_axis=request.param)
    out = write_results(tmp_path / "out", far_frames, FAR)
    blender.ops.refmesh.load_results(output=str(out))
    return blender.context.active_object


def shown(blender, member, frame):
    """(V, 3) positions that the modifiers give, in the coordinates of the object."""
    blender.context.scene.frame_set(frame)
    evaluated = member.evaluated_get(blender.context.evaluated_depsgraph_get())
    return read_positions(evaluated.data).astype(np.float64)


def test_the_root_carries_an_offset_and_the_scene_shows_the_body_at_the_origin(blender, far_solved):
    root = far_solved.refmesh.root
    offset = offset_of(root)
    assert_allclose(offset, FAR, atol=4)
    axes = np.rint(np.array(root.rotation_euler.to_matrix()))
    assert_array_equal(np.array(root.location), axes @ offset)
    assert_array_equal(np.array(root.matrix_world)[:3, 3], 0)
    assert_array_equal(np.array(place_in_world(root))[:3, 3], axes @ offset)
    root.parent.location = (0, 0, 0)
    blender.context.view_layer.update()
    assert_array_equal(np.array(root.matrix_world), np.array(place_in_world(root)))


def test_source_results_and_centers_are_precise_about_the_offset(blender, far_solved, far_frames):
    state = far_solved.refmesh
    offset = offset_of(state.root)
    state.show_source = True
    for number in NUMBERS:
        blender.context.scene.frame_set(number)
        captured = read_mesh(far_frames / f"ball_{number:04d}.obj").vertices
        assert_allclose(read_positions(far_solved.data), captured - offset, atol=PRECISE)
    for index, numbers in enumerate(GROUPS):
        group = state.groups[index]
        # Results were stored about another offset, by which their objects are moved.
        shift = np.array(group.deformed.location)
        assert_allclose(shift, np.array(FAR) - offset, atol=1e-6)
        assert_allclose(read_positions(group.reference.data) + shift, reference(index).vertices + FAR - offset, atol=PRECISE)
        for number in numbers:
            right = place(reference(index).vertices, number) + FAR - offset
            assert_allclose(shown(blender, group.deformed, number) + shift, right, atol=PRECISE)
    assert np.abs(read_positions(state.centers.data)).max() < 20


def test_exported_files_say_where_the_body_is(blender, far_solved, tmp_path):
    for kind in ("abc", "usd", "glb", "pc2"):
        blender.ops.refmesh.export(format=kind, directory=str(tmp_path / "export"))
    right = place(reference(0).vertices, NUMBERS[0]) + FAR
    ply = read_mesh(next((tmp_path / "export").glob("*_group_000.ply"))).vertices
    assert_allclose(ply + FAR, reference(0).vertices + FAR, atol=1e-9)
    assert_allclose(next(read_pc2(next((tmp_path / "export").glob("*_group_000.pc2")))) + np.array(FAR), right, atol=PRECISE)
    head = next((tmp_path / "export").glob("*_group_000.ply")).read_bytes().partition(b"end_header")[0]
    assert b"comment offset 2683000 1247000 450" in head


@pytest.mark.parametrize(("kind", "load"), [("abc", "alembic_import"), ("usd", "usd_import"), ("glb", None)])
def test_imported_again_the_files_are_precise(blender, far_solved, tmp_path, kind, load):
    offset = offset_of(far_solved.refmesh.root)
    place_there = np.array(place_in_world(far_solved.refmesh.root), dtype=np.float64)
    blender.ops.refmesh.export(format=kind, directory=str(tmp_path / "export"))
    path = next(path for path in (tmp_path / "export").iterdir() if path.suffix.startswith(f".{kind}"))
    blender.ops.wm.read_factory_settings(use_empty=True)
    if load:
        getattr(blender.ops.wm, load)(filepath=str(path))
    else:
        blender.ops.import_scene.gltf(filepath=str(path))
    blender.context.scene.frame_set(NUMBERS[0])
    member = next(item for item in blender.data.objects if item.type == "MESH" and "group_000" in item.name)
    matrix = np.array(member.matrix_world, dtype=np.float64)
    local = shown(blender, member, NUMBERS[0])
    right = place(reference(0).vertices, NUMBERS[0]) + FAR - offset
    turned = right @ place_there[:3, :3].T
    placed = local @ matrix[:3, :3].T
    order = np.lexsort(np.round(placed, 4).T), np.lexsort(np.round(turned, 4).T)
    assert_allclose(placed[order[0]] - placed.mean(axis=0), turned[order[1]] - turned.mean(axis=0), atol=4 * PRECISE)
    assert_allclose(matrix[:3, 3] + placed.mean(axis=0), place_there[:3, 3] + turned.mean(axis=0), atol=0.5)


def test_the_preview_shows_the_body_and_near_the_origin_nothing_is_moved(blender, far_solved, tmp_path):
    from refmesh_addon.bridge.sequence.raw_sequence import read_frame

    mesh = read_frame(far_solved.refmesh.frames[0].path, tmp_path)
    assert_allclose(np.ptp(mesh.vertices, axis=0), np.ptp(place(reference(1).vertices, NUMBERS[0]), axis=0), rtol=0.1)


def test_near_the_origin_there_is_no_offset(blender, solved):
    root = solved.refmesh.root
    assert root.parent is None
    assert_array_equal(offset_of(root), 0)
    assert_array_equal(np.array(root.location), 0)
