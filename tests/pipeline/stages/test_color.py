"""The color stage on real files: textures of every frame, whatever was wrong with some of them."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from PIL import Image

from refmesh_addon.core.color.layout import Layout
from refmesh_addon.core.color.texels import Texels
from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.geometry.mesh import merged
from refmesh_addon.core.settings import Settings
from refmesh_addon.io.files import read_npz
from refmesh_addon.io.images import decoded
from refmesh_addon.io.ply import read_colors, read_surface
from refmesh_addon.pipeline.run import run
from refmesh_addon.pipeline.session.job import JobSpec
from refmesh_addon.pipeline.session.parallel import Workers
from refmesh_addon.pipeline.stages.color_files import FALLBACKS
from tests.core.color.painted import cube_sphere

from ..colored_takes import GAINS, NUMBERS, STEP, material, write_textured, write_vertex_colored
from ..conftest import TINY
from ..running import cache_entries, finish, remade, report, results

SMALL = {"group_size": 2, "triangles": 1200}


@pytest.fixture(scope="module")
def take(tmp_path_factory):
    return write_textured(tmp_path_factory.mktemp("take"), GAINS)


@pytest.fixture(scope="module")
def baked(take, tmp_path_factory):
    output = tmp_path_factory.mktemp("baked")
    assert finish(take, output, **SMALL) == []
    return output


@pytest.fixture
def output(baked, tmp_path):
    """A copy of that folder, free to be changed."""
    return Path(shutil.copytree(baked, tmp_path / "baked"))


def picture(path) -> np.ndarray:
    return decoded(path.read_bytes(), path.name)


def texture_errors(output, frame, entry, index) -> np.ndarray:
    """Difference of a frame's texels from the true color of their places."""
    layout = read_npz(output / entry["layout"])
    texels = Texels.of(Layout(layout["uvs"], layout["triangles"]), 128)
    shown = picture(output / frame["texture"]).reshape(-1, 3)[texels.pixels]
    truth = material(texels.points(read_surface(output / frame["deformed"])) - STEP * index)
    return shown.astype(float) - truth


def test_every_frame_has_a_texture_of_the_size_of_the_capture(baked):
    found = report(baked)
    assert [frame["texture"] for frame in found["frames"]] == [f"texture/frame_{number:04d}.png" for number in NUMBERS]
    assert all(picture(baked / frame["texture"]).shape == (128, 128, 3) for frame in found["frames"])
    assert all(frame["color_psnr"] > 35 and frame["color_ssim"] > 0.95 for frame in found["frames"])
    assert all(group["layout_charts"] and group["layout_stretch"] < 1.2 for group in found["groups"])


def test_texels_have_the_color_of_their_place(baked):
    found = report(baked)
    first = texture_errors(baked, found["frames"][0], found["groups"][0], 0)
    assert np.abs(np.median(first)) < 3
    assert np.percentile(np.abs(first), 90) < 12  # the ball turns, so its texels drift by as much as it shows


def test_exposure_is_evened_by_the_gains_that_are_reported(take, output):
    finish(take, output, exposure="even", **SMALL)
    gains = np.array([frame["gain"] for frame in report(output)["frames"]])
    truth = 1 / np.array(GAINS)
    assert_allclose(gains / gains[0], np.repeat((truth / truth[0])[:, None], 3, axis=1), rtol=0.02)
    assert_allclose(np.log(gains).sum(axis=0), 0, atol=1e-9)


def test_same_bytes_with_one_process(take, baked, tmp_path):
    settings = Settings.from_flat({**TINY.to_flat(), **SMALL})
    with Workers(1) as workers:
        run(JobSpec(str(take), str(tmp_path), settings=settings), lambda *progress: None, lambda line: None, workers)
    assert results(tmp_path) == results(baked)


def test_textures_that_were_deleted_come_back_from_the_cache(take, output, baked):
    before = cache_entries(output)
    for path in (output / "texture").iterdir():
        path.unlink()
    finish(take, output, **SMALL)
    assert cache_entries(output) == before
    assert results(output) == results(baked)


def test_a_changed_picture_is_baked_again_and_no_other(take, output, tmp_path):
    changed, before = Path(shutil.copytree(take, tmp_path / "take")), cache_entries(output)
    (changed / "ball_004.png").write_bytes((changed / "ball_003.png").read_bytes())
    finish(changed, output, **SMALL)
    made = remade(before, cache_entries(output))
    assert "color/frame_0004" in made and "color/frame_0003" not in made
    assert {name.partition("/")[0] for name in made} == {"color"}


def test_off_makes_no_textures_and_removes_those_there(take, output):
    finish(take, output, texture="off", **SMALL)
    assert not list((output / "texture").iterdir())
    assert "texture" not in report(output)["frames"][0]


@pytest.mark.parametrize("changes", [{}, {"texture": "off"}])
def test_a_painted_steady_texture_is_kept_under_another_name(take, output, changes):
    """Whatever the next run does with its own; and only once, as the new one is as RefMesh wrote it."""
    steady = output / "texture" / "group_000_steady.png"
    written = steady.read_bytes()
    steady.write_bytes(b"painted")
    warnings = finish(take, output, **{**SMALL, **changes})
    assert any("texture/group_000_steady_painted_1.png" in line for line in warnings)
    assert (output / "texture" / "group_000_steady_painted_1.png").read_bytes() == b"painted"
    assert not any("painted" in line for line in finish(take, output, **SMALL))
    assert steady.read_bytes() == written


def test_size_and_format_can_be_chosen(take, output):
    finish(take, output, texture="512", texture_format="jpeg", **SMALL)
    assert picture(output / "texture" / "frame_0003.jpg").shape == (512, 512, 3)
    assert not list((output / "texture").glob("frame_*.png"))


def test_unknown_size_is_refused():
    with pytest.raises(RefMeshError, match="texture is '77': choose one of auto, off, 512"):
        finish("take", "out", texture="77")


def test_geometry_goes_through_whatever_is_wrong_with_pictures_and_the_steady_texture_fills_in(take, output, tmp_path):
    """One is cut off, one is gray with 16 bits, half as large and named in another case, and one lies outside of the take."""
    changed = Path(shutil.copytree(take, tmp_path / "take"))
    (changed / "ball_004.png").write_bytes((changed / "ball_004.png").read_bytes()[:3000])
    (changed / "ball_005.png").rename(tmp_path / "outside.png")
    (changed / "ball_005.mtl").write_text("newmtl skin\nmap_Kd ../outside.png\n")
    gray = picture(changed / "ball_006.png")[::2, ::2, 0]
    (changed / "ball_006.png").unlink()
    Image.fromarray(gray.astype(np.uint16) * 257).save(changed / "BALL_006.PNG")
    warnings = finish(changed, output, **SMALL)
    for sentence in ("ball_004.png", "ball_005.obj: names '../outside.png'", "frames 4-5: no color", "from 64 to 128 pixels"):
        assert sum(sentence in line for line in warnings) == 1, sentence
    frames, groups = report(output)["frames"], report(output)["groups"]
    assert [frame["filled"] > 0.99 for frame in frames] == [False, True, True, False] and "color_psnr" not in frames[1]
    assert np.abs(texture_errors(output, frames[1], groups[0], 0)).mean() < 8
    shown = picture(output / frames[3]["texture"])
    assert shown.shape == (128, 128, 3) and (shown == shown[:, :, :1]).all()


def test_vertex_colors_go_to_vertices(tmp_path):
    take = write_vertex_colored(tmp_path / "take")
    finish(take, tmp_path / "out", **SMALL)
    for index, frame in enumerate(report(tmp_path / "out")["frames"]):
        path = tmp_path / "out" / frame["colored"]
        error = read_colors(path)[:, :3].astype(float) - material(read_surface(path).vertices - STEP * index)
        assert np.abs(error).mean() < 8
    assert not (tmp_path / "out" / "texture").exists()


def write_own(path, scale: float = 1.0) -> Path:
    """A closed ball over the first frame with the UV map of six squares.  scale : of that map."""
    mesh, layout = cube_sphere(9)
    ball, _ = merged(mesh)
    rows = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in ball.vertices] + [f"vt {u:.6f} {v:.6f}" for u, v in scale * layout.uvs]
    corners = zip(ball.triangles + 1, layout.triangles + 1)
    rows += ["f " + " ".join(f"{vertex}/{place}" for vertex, place in zip(triangle, places)) for triangle, places in corners]
    path.write_text("\n".join(rows) + "\n")
    return path


def test_a_mesh_of_the_user_keeps_its_uv_map(take, tmp_path):
    own = write_own(tmp_path / "own.obj")
    assert finish(take, tmp_path / "out", mesh=str(own), mesh_frame=NUMBERS[0], group_size=4) == []
    (group,) = report(tmp_path / "out")["groups"]
    assert group["layout_source"] == "own" and group["layout_charts"] == 6
    stored = read_npz(tmp_path / "out" / group["layout"])
    assert_allclose(stored["uvs"][stored["triangles"]], cube_sphere(9)[1].corners, atol=1e-6)
    for index, frame in enumerate(report(tmp_path / "out")["frames"]):
        assert np.abs(texture_errors(tmp_path / "out", frame, group, index) / GAINS[index]).mean() < 25


def test_a_uv_map_beyond_the_square_gives_way_to_another_layout(take, tmp_path, monkeypatch):
    """Here to the plainest one, as xatlas fails and there is no Blender."""
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "xatlas.py").write_text("raise ImportError('of another Python')")
    monkeypatch.syspath_prepend(tmp_path / "broken")  # worker processes and theirs have the same path
    own, said = write_own(tmp_path / "own.obj", scale=1.5), []
    settings = Settings.from_flat({**TINY.to_flat(), "mesh": str(own), "mesh_frame": NUMBERS[0], "group_size": 4})
    with Workers(1) as workers:
        run(JobSpec(str(take), str(tmp_path / "out"), "3-4", settings=settings), lambda *progress: None, said.append, workers)
    (group,) = report(tmp_path / "out")["groups"]
    assert group["layout_source"] == "projected" and group["layout_stretch"] < 1.1 and group["layout_area"] > 0
    refused, plainer = said
    assert "own.obj: its UV map cannot hold the colors: it reaches" in refused
    assert plainer == f"group 0: {FALLBACKS['projected']} is used; it has {group['layout_charts']} charts"
