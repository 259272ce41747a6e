"""Takes of one camera from their frames to the results."""

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.evaluation.segment_limits import FrameFigures
from refmesh_addon.core.geometry.borders import boundary_edges
from refmesh_addon.core.geometry.mesh import is_watertight, vertex_components
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.ply import read_surface, read_visibility, write_ply
from refmesh_addon.pipeline.stages.open_reference import anchor_penalty
from refmesh_addon.pipeline.stages.probes import counted
from sample_scenes.generators.depth_camera import DepthCamera
from sample_scenes.generators.shapes import ball, capsule, union
from sample_scenes.generators.surface import iso_surface

from .running import finish, report

OPEN_RUN = {"centers": 60, "resolution": 40, "triangles": 1500}
CAMERA = DepthCamera((0.0, -1.0, 6.0), (0.0, 0.0, 0.0), width=56)


def body(shift: float) -> TriangleMesh:
    """A head with an ear, so that it shows how it moves."""
    solid = union(ball((shift, 0, 0), 1.0), capsule((shift, 0.8, 0.3), (shift, 1.6, 0.3), 0.35))
    return iso_surface(solid, np.zeros(3), 2.5, 0.15, np.random.default_rng(0))


# A plate, of which the camera sees hardly more than one edge.
SEEN_EDGE_ON = TriangleMesh([[-0.02, -1, 0], [0.02, -1, 0], [0.02, 1, 0.0], [-0.02, 1, 0]], [[0, 1, 2], [0, 2, 3]])


@pytest.fixture(scope="module")
def take(tmp_path_factory):
    """Three frames of one camera that sees the body pass."""
    folder = tmp_path_factory.mktemp("one_camera")
    for number in range(3):
        write_ply(folder / f"take_{number}.ply", CAMERA.seen(body(0.1 * number), number))
    return folder


@pytest.fixture(scope="module")
def run(take, tmp_path_factory):
    """Output folder of the run, and its warnings."""
    output = tmp_path_factory.mktemp("out")
    return output, finish(take, output, **OPEN_RUN)


def test_of_views_distances_and_what_is_out_of_view_count_when_runs_are_reviewed():
    figures = FrameFigures(mean=1e-4, p99=1e-3, flipped=0.01, overstretched=0.1, unseen=0.2)
    views, bodies = (SimpleNamespace(frames=SimpleNamespace(take=take)) for take in ("open", None))
    assert counted(bodies, figures) == replace(figures, unseen=0.0)
    assert counted(views, figures) == replace(figures, flipped=0.0, overstretched=0.0)


def test_the_anchor_frame_of_a_view_is_near_the_middle_and_that_of_bodies_one_with_clean_rims():
    statistics = {frame: SimpleNamespace(rim_excess=0.1 * frame) for frame in range(9)}
    views, bodies = (SimpleNamespace(frames=SimpleNamespace(take=take, statistics=statistics)) for take in ("open", None))
    assert anchor_penalty(views, (4, 5, 6, 7, 8)).tolist() == [2, 1, 0, 1, 2]
    assert anchor_penalty(bodies, (4, 6)) == pytest.approx([0.4, 0.6])


def test_the_kind_of_the_take_is_told_once(run):
    output, warnings = run
    assert sum("open surfaces" in line for line in warnings) == 1
    assert not any("inside out" in line or "more volume" in line for line in warnings)
    assert report(output)["surface"] == "open"


def test_the_reference_mesh_is_open_and_in_one_piece_and_no_frame_is_left_out(run):
    (group,) = report(run[0])["groups"]
    mesh = read_surface(run[0] / group["reference"])
    assert not group["watertight"] and len(boundary_edges(mesh)) and not group["left_out"]
    assert vertex_components(mesh)[0] == 1
    assert (run[0] / group["visibility"]).is_file()


def test_frames_are_close_to_what_was_kept_and_visible_vertices_to_the_source(run):
    for frame in report(run[0])["frames"]:
        assert 0.8 < frame["kept"] < 1.0
        assert frame["kept"] + frame["skirts"] + frame["flying"] + frame["frayed"] == pytest.approx(1.0)
        assert len(read_surface(run[0] / "removed" / Path(frame["deformed"]).name).triangles)
        assert frame["source_to_deformed"]["mean"] < 0.003
        assert frame["visible_to_source"]["max"] < 0.02 and frame["unseen"] < 0.3
        assert frame["border"]["mean"] < 0.02
        visibility = read_visibility(run[0] / frame["deformed"])
        assert visibility.min() >= 0 and visibility.max() == 1 and visibility.mean() > 0.7


def test_a_take_that_is_told_to_be_closed_gets_closed_meshes(take, tmp_path):
    warnings = finish(take, tmp_path, surface="closed", **OPEN_RUN)
    (group,) = report(tmp_path)["groups"]
    assert report(tmp_path)["surface"] == "closed" and group["watertight"]
    assert is_watertight(read_surface(tmp_path / group["reference"]))
    assert sum("is a guess that closes it" in line for line in warnings) == 1
    assert "kept" not in report(tmp_path)["frames"][0]


def test_a_frame_with_everything_else_in_view_and_one_seen_from_elsewhere_are_followed(tmp_path):
    """A closed frame among open ones, and a camera that moves."""
    source = tmp_path / "in"
    source.mkdir()
    cameras = [CAMERA, DepthCamera((1.5, -1.0, 5.8), (0.0, 0.0, 0.0), width=56), CAMERA]
    meshes = [camera.seen(body(0.05 * number), number) for number, camera in enumerate(cameras)]
    meshes.append(body(0.15))
    for number, mesh in enumerate(meshes):
        write_ply(source / f"take_{number}.ply", mesh)
    warnings = finish(source, tmp_path / "out", **OPEN_RUN | {"group_size": 4})
    frames = report(tmp_path / "out")["frames"]
    assert len(frames) == 4 and report(tmp_path / "out")["surface"] == "open"
    assert max(frame["visible_to_source"]["max"] for frame in frames) < 0.04
    assert any(report(tmp_path / "out")["tracking"]["born"]), "for what only the closed frame shows"
    assert not any("appeared" in line or "lie outside" in line for line in warnings)
    assert len(report(tmp_path / "out")["groups"]) == 1, "centers out of view are carried along"


@pytest.mark.parametrize(
    ("second", "expected"),
    [
        (body(0.05), "frame 0: is open: .*1 of 2 frames: 0; as a take of their own .--frames 0 --surface open. they stay open"),
        (TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3), int)), "take_1.ply: holds no triangles; .* leave it out with --frames"),
        (SEEN_EDGE_ON, "take_1.ply: too little volume to track .*; .*--frames leaves this frame out"),
    ],
    ids=["turns to closed", "empty", "edge on"],
)
def test_a_frame_unlike_the_others_is_named_with_what_helps(tmp_path, second, expected):
    source = tmp_path / "in"
    source.mkdir()
    write_ply(source / "take_0.ply", CAMERA.seen(body(0.0), 0))
    write_ply(source / "take_1.ply", second)
    try:
        lines = finish(source, tmp_path / "out", until="tracking", **OPEN_RUN)
    except RefMeshError as error:
        lines = [str(error)]
    assert any(re.search(expected, line) for line in lines), lines


def test_holes_of_bodies_are_closed_or_left_open_as_told(tmp_path):
    source = tmp_path / "in"
    source.mkdir()
    for number in range(2):
        whole = body(0.1 * number)
        centers = whole.vertices[whole.triangles].mean(axis=1)
        write_ply(source / f"take_{number}.ply", TriangleMesh(whole.vertices, whole.triangles[centers[:, 1] > -0.8]))
    rims = {}
    for holes in ("closed", "open"):
        finish(source, tmp_path / holes, holes=holes, **OPEN_RUN)
        (group,) = report(tmp_path / holes)["groups"]
        mesh = read_surface(tmp_path / holes / group["reference"])
        rims[holes] = mesh.vertices[np.unique(boundary_edges(mesh))]
        assert report(tmp_path / holes)["surface"] == "closed" and group["watertight"] == (holes == "closed")
        assert max(frame["source_to_deformed"]["mean"] for frame in report(tmp_path / holes)["frames"]) < 0.003
    assert not len(rims["closed"]) and np.abs(rims["open"][:, 1] + 0.8).max() < 0.15


def test_global_rounds_are_left_out_in_words(take, tmp_path):
    warnings = finish(take, tmp_path, until="tracking", global_rounds=2, **OPEN_RUN)
    assert sum("--global-rounds is left out" in line for line in warnings) == 1
    assert "global_energies" not in report(tmp_path)["tracking"]


def test_a_run_may_be_as_long_as_it_holds(take, tmp_path):
    finish(take, tmp_path, segments="long", until="evaluation", **OPEN_RUN)
    groups, frames = report(tmp_path)["groups"], report(tmp_path)["frames"]
    assert [number for group in groups for number in group["frames"]] == [0, 1, 2]
    assert all(group["reason"] for group in groups)
    assert max(frame["visible_to_source"]["max"] for frame in frames) < 0.02


def test_a_run_down_to_one_group_is_divided_where_the_view_changes(tmp_path):
    source = tmp_path / "in"
    source.mkdir()
    bar = iso_surface(capsule((-1.5, 0, 0), (1.5, 0, 0), 0.5), np.zeros(3), 2.5, 0.15, np.random.default_rng(0))
    for number, mesh in enumerate([body(0.0), body(0.05), bar, bar.moved(bar.vertices + [0.05, 0, 0])]):
        write_ply(source / f"take_{number}.ply", CAMERA.seen(mesh, number))
    finish(source, tmp_path / "out", segments="long", until="evaluation", **OPEN_RUN | {"group_size": 4})
    groups = [tuple(group["frames"]) for group in report(tmp_path / "out")["groups"]]
    assert [number for group in groups for number in group] == [0, 1, 2, 3]
    assert any(group[0] == 2 for group in groups), "between the two shapes"
