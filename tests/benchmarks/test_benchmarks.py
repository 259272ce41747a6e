"""Each benchmark in its smallest form: it ends with one line of JSON whose figures are there and finite."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from benchmarks import arap, drift, figures, matching, memory, published_tracking, reconstruction
from benchmarks.common import tracked
from benchmarks.frames import frames_folder
from benchmarks.trajectories import CASES, Case, judge
from refmesh_addon.core.deformation.arap import ArapSolver
from refmesh_addon.core.evaluation.distances import Distances
from refmesh_addon.core.geometry.mesh import is_watertight, sample_surface, triangle_normals
from refmesh_addon.core.settings import Settings, TrackingSettings
from refmesh_addon.core.surfacing.reconstruction import reconstruction_depth
from refmesh_addon.core.tracking.volume import sample_volume
from refmesh_addon.io.ply import write_ply
from refmesh_addon.io.report import FrameReport, GroupReport, Report
from refmesh_addon.io.sequence import Frame, Sequence
from sample_scenes.generators import SEQUENCES

from ..core.shapes import ball, box, joined, moved

ROOT = Path(__file__).resolve().parents[2]
SMALL = ("--centers", "40", "--resolution", "32")
SETTINGS = TrackingSettings(centers=40, resolution=32)
FRAMES = 3


@pytest.fixture(scope="module")
def cache(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("frames")


def last_line(name: str, *options: str) -> dict:
    """What the benchmark's last line says."""
    done = subprocess.run([sys.executable, "-m", f"benchmarks.{name}", *options], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def numbers(value) -> list[float]:
    """Every number anywhere inside."""
    if isinstance(value, dict):
        value = list(value.values())
    return [number for item in value for number in numbers(item)] if isinstance(value, list) else [value] * isinstance(value, (int, float))


def test_trajectories(cache):
    options = ("--frames", str(FRAMES), "--set", "resolution=33", "--repeat", "--cache", str(cache))
    found = last_line("trajectories", *SMALL, "--cases", "bar", "appear", *options)
    assert found["settings"]["resolution"] == 33
    everywhere = {"median", "p95", "wrong_end", "wrong_worst", "dfu_mean", "dfu_end", "lost", "not_finite", "repeat_median", "repeat_p95"}
    assert set(found["cases"]) == {"bar", "appear"}
    assert all(everywhere <= set(case) for case in found["cases"].values())
    assert {"late_centers", "late_volume"} <= set(found["cases"]["appear"])
    assert np.isfinite(numbers(found)).all()


def test_tracking(cache):
    found = last_line("tracking", *SMALL, str(frames_folder("bar", FRAMES, cache)), "--frames", "1-2", "--limit", "20")
    expected = {"seconds", "published_seconds", "ratio", "energy_ratio", "same_energy", "ratio_to_our_energy", "published_finished"}
    assert expected <= set(found)
    assert found["frames"] == 1
    assert found["published_finished"]
    assert np.isfinite(numbers(found)).all()


def test_memory(cache):
    found = last_line("memory", *SMALL, "--triangles", "600", "--frames", "3", "6", "--cache", str(cache))
    assert {"main_mebibytes", "worker_mebibytes", "peak_mebibytes", "peak_ratio", "pace", "pace_ratio"} <= set(found)
    assert (found["frames"], found["until"]) == ([3, 6], "color")
    assert min(found["peak_mebibytes"]) > 1
    assert np.isfinite([*found["peak_mebibytes"], *found["pace"], found["peak_ratio"], found["pace_ratio"]]).all()


@pytest.mark.parametrize("method", reconstruction.METHODS.values(), ids=reconstruction.METHODS)
def test_reconstruction(method):
    """The smallest group there is: one body, known in closed form."""
    ball = next(iter(SEQUENCES["tumble"]().frames(1)))
    rng = np.random.default_rng(0)
    points, owners = sample_surface(ball, 6000, rng)
    depth = reconstruction_depth(ball, 1000)
    found = reconstruction.measured(points, triangle_normals(ball)[owners], 0.1 * ball.diagonal, 1000, depth, *method)
    assert found["watertight"]
    assert found["crossing"] == 0
    assert found["triangles"] == pytest.approx(1000, rel=0.01)
    assert found["points_to_mesh"]["mean"] < 0.5
    assert np.isfinite(numbers(found)).all()


def test_figures_of_a_run(tmp_path):
    ways = {way: Distances(0.001 * k, 0.0015 * k, 0.002 * k, 0.003 * k) for k, way in enumerate(figures.WAYS, 1)}
    frames = [FrameReport(number, 0, f"deformed/frame_{number:04d}.ply", **ways) for number in (1, 2)]
    iou = {"iou_before": 0.9, "iou_after": 0.95, "frame_iou_before": (1.0, 0.9), "frame_iou_after": (1.0, 0.95)}
    surface = {"triangles": 10, "components": 1, "watertight": True, "self_intersections": 0}
    group = GroupReport(0, (1, 2), 1, "reference/group_000.ply", stress=0.01, **surface, **iou)
    sequence = Sequence("a", tuple(Frame(number, tmp_path / f"a_{number}.obj") for number in (1, 2)))
    seconds = {"tracking": 1.5, "reference": 2.0}
    Report(str(tmp_path), sequence, Settings(), seconds=seconds, groups=[group], frames=frames).write(tmp_path)
    done = subprocess.run([sys.executable, "-m", "benchmarks.figures", str(tmp_path)], cwd=ROOT, capture_output=True, text=True, check=True)
    row = json.loads(done.stdout.splitlines()[-1])["rows"][0]
    assert row["deformed_to_source_p99"] == pytest.approx([0.4, 0.4])
    assert row["closed"] == "1 of 1"
    assert row["seconds"] == 3.5
    assert done.stdout.startswith("| a, 2 frames | 0.1 | 0.2 | 0.3 | 0.2 |")


def test_deformation_speed(cache):
    source = frames_folder("beam", FRAMES, cache)
    small = [option for name, value in (("centers", 40), ("resolution", 32), ("triangles", 600)) for option in ("--set", f"{name}={value}")]
    found = last_line("deformation_speed", str(source), "--frames", "1-2", "--repeat", "1", "--against", str(ROOT), *small)
    assert set(found["states"]) == {"here", "against"}
    assert all(row["deformed"] == 2 and row["triangles"] <= 600 and row["seconds"] > 0 for row in found["states"].values())
    assert np.isfinite(numbers(found)).all() and found["ratio"] > 0


def test_drift(cache):
    small = ("--set", "centers=60", "--set", "resolution=32", "--set", "samples=1000", "--set", "triangles=2000")
    options = ("--cases", "tumble", "--frames", "4", "--of", "6", "--set", "group_size=3", "--cache", str(cache))
    found = last_line("drift", *options, *small)["cases"]["tumble"]
    expected = {"median", "p95", "acceleration_ratio", "true_acceleration_ratio", "mean_distance", "flipped"}
    assert expected | {"jump_ratio", "captured_jump_ratio"} <= set(found)
    assert np.isfinite(numbers(found)).all()
    assert found["median"] < 1.0
    assert found["true_acceleration_ratio"] > 0


def test_drift_of_the_true_motion_is_none(cache):
    case = Case.named("beam", FRAMES, cache)
    truth = drift.moved(case, case.meshes[0].vertices, 0, np.arange(FRAMES))
    assert_allclose(truth[0], case.meshes[0].vertices, atol=1e-9)
    take = drift.Take(np.arange(FRAMES), truth, truth, case.meshes[0].triangles, 0, 1.0)
    found = drift.figures(case, [take], truth)
    assert found["median"] == found["p95"] == 0.0
    assert_allclose(found["acceleration_ratio"], 1.0)
    first, second = (drift.Take(np.array([at]), truth[[at]], truth[[at]], take.triangles, 0, 1.0) for at in (0, 1))
    jump, errors, captured = drift.boundary(case, first, second)
    assert_allclose(jump, 0.0, atol=1e-9)
    assert errors > 0 and captured > 0  # the second frame's own triangles are others


def test_arap():
    found = last_line("arap", "--vertices", "800", "--iterations", "3", "--methods", "refmesh")
    assert found["vertices"] == 800
    assert found["methods"]["refmesh"]["energy"] > 0
    assert np.isfinite(numbers(found)).all()


def test_arap_energy_is_the_solvers_own():
    mesh = arap.torus(800)
    assert is_watertight(mesh)
    handles, targets = arap.task(mesh)
    result = ArapSolver(mesh, 0.0).deform(handles, targets[0], mesh.vertices, weight=np.inf, iterations=5)
    assert_allclose(arap.energy(mesh, result.vertices), result.energies[-1], rtol=1e-9)
    assert_allclose(arap.energy(mesh, mesh.vertices @ np.diag([1.0, -1.0, -1.0]) + 3), 0.0, atol=1e-12)


@pytest.mark.parametrize("name", ["libigl", "open3d"])
def test_arap_ends_where_others_do(name):
    pytest.importorskip({"libigl": "igl"}.get(name, name), reason="libigl and Open3D come with `make peers`")
    mesh = arap.torus(800)
    found = arap.compared({key: arap.METHODS[key] for key in ("refmesh", name)}, mesh, 200, 1)
    assert_allclose(found["refmesh"]["energy"], found[name]["energy"], rtol=1e-3)


def test_matching():
    found = last_line("matching", "--cell", "4.5")
    assert set(found["methods"]) == set(matching.METHODS)
    assert np.isfinite(numbers(found)).all()
    assert all(0 <= method[key] <= 1 for method in found["methods"].values() for key in ("precision", "recall"))
    assert found["methods"]["guided"]["precision"] >= 0.8


@pytest.mark.parametrize("name", CASES)
def test_the_true_motion_is_judged_faultless(name, cache):
    case = Case.named(name, FRAMES, cache)
    points = sample_volume(case.meshes[0], 32, 40).finest.positions[::5]
    own = case.bodies_of(points, case.times[0])
    rest = case.sequence.rest(points, own, case.times[0])
    found = judge(case, np.stack([case.sequence.motion(rest, own, when) for when in case.times]), spacing=1.0)
    assert found.judged[0].all()
    assert_allclose(found.errors[found.judged], 0.0, atol=1e-9 * case.sequence.reach)
    assert not found.wrong.any()


def test_a_center_that_changes_its_body_is_found_out(cache):
    case = Case.named("collide", FRAMES, cache)
    points = sample_volume(case.meshes[0], 32, 40).finest.positions[::5]
    own = case.bodies_of(points, case.times[0])
    one, other = np.flatnonzero(own == 0)[0], np.flatnonzero(own == 1)[0]
    rest = case.sequence.rest(points, own, case.times[0])
    positions = np.stack([case.sequence.motion(rest, own, when) for when in case.times])
    positions[-1, [one, other]] = positions[-1, [other, one]]
    found = judge(case, positions, spacing=1.0)
    assert set(np.flatnonzero(found.wrong[-1])) == {one, other}
    assert not found.wrong[:-1].any()


def test_centers_of_a_body_that_left_have_no_true_place(cache):
    case = Case.named("leave", FRAMES, cache)
    points = sample_volume(case.meshes[0], 32, 40).finest.positions[::5]
    own = case.bodies_of(points, case.times[0])
    found = judge(case, np.stack([points] * FRAMES), spacing=1.0)
    assert (found.judged[-1] == (own == 0)).all()
    assert not found.judged[-1].all()


def test_published_schedule_carries_a_rigid_body_rigidly(cache):
    case = Case.named("tumble", 6, cache)
    start = next(tracked(case.meshes[:1], SETTINGS))[0]
    frames = published_tracking.track(case.meshes, 32, start.centers, limit=60.0)
    assert all(frame.finished for frame in frames)
    found = judge(case, np.stack([frame.centers for frame in frames]), start.affinity.spacing)
    assert np.median(found.errors) < 0.15


def test_published_schedule_lowers_the_energy_that_judges_it(cache):
    case = Case.named("bar", FRAMES, cache)
    start = next(tracked(case.meshes[:1], SETTINGS))[0]
    frames = published_tracking.track(case.meshes[:2], 32, start.centers, limit=60.0)
    first, last = published_tracking.energies([frame.centers for frame in frames], case.meshes[:2], 32)
    assert first == pytest.approx((start.lloyd_energy, 0.0), rel=0.1)  # over all voxels, in a grid along the axes
    assert sum(last) < frames[1].trace[0][1]
    assert frames[1].seconds_to(frames[1].trace[-1][1]) <= frames[1].seconds
    assert frames[1].seconds_to(0.0) is None


def test_a_take_played_to_and_fro_has_the_same_groups():
    frames = [Path("a"), Path("b"), Path("c")]
    assert "".join(str(frame) for frame in memory.to_and_fro(frames, 9)) == "abccbaabc"


def test_references(cache):
    ways = ("ours", "ours, groups by content", "first frame")
    found = last_line("references", str(frames_folder("tumble", FRAMES, cache)), "--frames", "1-2", "--ways", *ways)
    assert set(found["rows"]) == set(ways)
    for row in found["rows"].values():
        assert row["carried_mean"] > 0 and row["fitted_mean"] > 0
    assert np.isfinite(numbers({name: row for name, row in found["rows"].items() if row["iou_after"]})).all()


def test_primitives(tmp_path):
    plain = box((2.0, 2.0, 1.0), subdivisions=4)
    top = np.argmin(np.linalg.norm(plain.vertices - [0, 0, 0.5], axis=1))
    dented = plain.moved(plain.vertices - 0.1 * np.eye(3)[2] * (np.arange(len(plain.vertices)) == top)[:, None])
    write_ply(tmp_path / "a.ply", joined(plain, moved(ball(4), shift=(5.0, 0, 0))))
    write_ply(tmp_path / "b.ply", dented)
    rows = last_line("primitives", str(tmp_path / "a.ply"), str(tmp_path / "b.ply"))["rows"]
    assert [row["kind"] for row in rows] == ["box", "ball", "box"]
    assert rows[0]["max"] < 1e-3 and rows[1]["max"] < 0.3
    assert rows[2]["max"] == pytest.approx(5.0, abs=1.0) and rows[2]["max_of_shortest"] == pytest.approx(10.0, abs=2.0)


def test_paper_figures(cache, tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.paper_figures", str(frames_folder("tumble", FRAMES, cache)), "--resolution", "32"]
        + ["--centers", "40", "--sizes", "2", "9", "--deformed", "2", "--folder", str(tmp_path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    rows = json.loads(done.stdout.splitlines()[-1])["rows"]
    assert [(row["pipeline"], row["size"]) for row in rows] == [("ours", 2), ("paper", 2), ("unaligned", 2)]
    assert all(0 < row["fitted_source_to_deformed_mean"] < 5 and 0 < row["source_to_deformed_mean"] < 5 for row in rows)
    assert len((tmp_path / "distances.csv").read_text().splitlines()) == 1 + len(rows)
    for name in ("distances.png", "references.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")


def test_frame_change():
    found = last_line("frame_change", "--vertices", "500", "--frames", "4")
    assert {"memory_ms", "cache_ms", "file_ms", "limit_ms", "file_over_cache"} <= set(found) and found["vertices"] > 400
