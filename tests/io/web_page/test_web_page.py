"""The page in a real browser: it plays, and shows what the results hold."""

import base64
import functools
import io
import shutil
import threading
from dataclasses import replace
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import pytest
from PIL import Image

from refmesh_addon.core.color.raster import rasterized
from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.io.small_glb.choice import SmallGlb
from refmesh_addon.io.small_glb.writer import encoded
from refmesh_addon.io.web_page import writer
from refmesh_addon.io.web_page.writer import Take, viewer_problem, write_web_page
from tests.io.refmesh_stream.bodies import torus_groups
from tests.io.small_glb.test_surface import painted
from tests.io.small_glb.unpacking import Glb
from tests.io.web_page.browser import started_browser

DIAGONAL, RATE = 4.0, 30.0
CHOICE = SmallGlb(error=2e-3, triangles=(2000,), packed=True, texture=256)
FRAMES = (4, 5, 6, 8, 9)
TITLE = "Torus </script> & ball"
NOTHING_DRAWN = 12  # gray levels around the background's
LEAST_OVERLAP = 0.97  # IoU of a picture's outline with that of the result: pixels along the outline differ

needs_viewer = pytest.mark.skipif(bool(viewer_problem()), reason=viewer_problem() or "-")


@pytest.fixture(scope="module")
def browser():
    with started_browser() as browser:
        yield browser


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return written(tmp_path_factory.mktemp("page") / "torus_web", torus_groups())


def written(folder, groups, choice=CHOICE):
    data, runs = encoded(groups, DIAGONAL, RATE, choice)
    write_web_page(folder, "torus", Take(TITLE, data, runs, RATE))
    return folder


@pytest.fixture
def page(browser, folder):
    """The browser with the page open from the disk, halted at the first frame."""
    return opened(browser, folder)


def opened(browser, folder):
    browser.open((folder / "index.html").as_uri() + "?paused")
    browser.wait("window.refmesh && (window.refmesh.ready || window.refmesh.error)")
    assert browser.run("return refmesh.error || ''") == ""
    return browser


def frame(page):
    return page.run("return refmesh.playback.frame")


def canvas(page):
    """(H, W, 3) int, what is drawn, without the controls."""
    url = page.run("refmesh.viewer.render(); return document.getElementById('canvas').toDataURL('image/png')")
    return np.array(Image.open(io.BytesIO(base64.b64decode(url.partition(",")[2]))).convert("RGB")).astype(int)


def outline(picture):
    """(H, W) bool, where something other than the background is drawn."""
    return np.abs(picture - picture[0, 0]).max(axis=2) > NOTHING_DRAWN


@needs_viewer
def test_every_frame_has_the_positions_of_the_file(page, folder):
    glb = Glb((folder / "torus.glb").read_bytes())
    for number in FRAMES:
        shown = page.run("refmesh.playback.seek(arguments[0]); return refmesh.viewer.positions()", number)
        expected, _ = glb.at((number - FRAMES[0]) / RATE)
        np.testing.assert_allclose(np.reshape(shown, (-1, 3)), expected, atol=1e-5)


@needs_viewer
def test_every_picture_has_the_outline_of_the_result(page):
    for group in torus_groups():
        for number, positions in zip(group.numbers, group.positions):
            matrices = page.run(
                "refmesh.playback.seek(arguments[0]); refmesh.viewer.render(); const camera = refmesh.viewer.camera;"
                "return [camera.projectionMatrix.elements, camera.matrixWorldInverse.elements]",
                number,
            )
            drawn = outline(canvas(page))
            right = projected_outline(positions, group.triangles, matrices, drawn.shape)
            assert (drawn & right).sum() / (drawn | right).sum() > LEAST_OVERLAP


def projected_outline(positions, triangles, matrices, shape):
    projection, view = (np.reshape(elements, (4, 4)).T for elements in matrices)
    clip = np.column_stack([positions, np.ones(len(positions))]) @ (projection @ view).T
    height, width = shape
    places = (clip[:, :2] / clip[:, 3:] * [0.5, -0.5] + 0.5) * [width, height]
    covered = np.zeros(height * width, bool)
    covered[rasterized(places[triangles], width, height).pixels] = True
    return covered.reshape(shape)


@needs_viewer
def test_nothing_outside_of_the_folder_is_loaded(page, folder):
    names = page.run("return performance.getEntriesByType('resource').map((entry) => entry.name)")
    assert {name.partition("?")[0] for name in names if not name.startswith("blob:")} <= {path.as_uri() for path in folder.iterdir()}
    assert page.console() == []


@needs_viewer
def test_it_plays_in_a_circle_and_halts(page):
    page.click("#play")
    seen = {frame(page)}
    for _ in range(400):
        seen.add(frame(page))
        if seen >= set(range(4, 10)):
            break
    assert seen == set(range(4, 10))
    assert page.run("return document.getElementById('play').textContent") == "Pause"
    page.click("#play")
    halted = frame(page)
    page.wait("new Promise((resolve) => setTimeout(() => resolve(true), 200))")
    assert frame(page) == halted


@needs_viewer
def test_keys_and_slider_choose_a_frame(page):
    page.press("\ue014", "\ue014")  # right
    assert frame(page) == 6
    page.press("\ue012")  # left
    assert frame(page) == 5
    page.run("const slider = document.getElementById('frame'); slider.value = 9; slider.dispatchEvent(new Event('input'))")
    assert frame(page) == 9 and page.run("return document.getElementById('number').textContent") == "Frame 9"
    page.press("\ue014")
    assert frame(page) == 9  # the last


@needs_viewer
def test_dragging_orbits_and_a_button_goes_back(page):
    before = canvas(page)
    page.drag((320, 150), (420, 110))
    page.wait("refmesh.viewer.controls.getAzimuthalAngle() < -0.1")
    assert (canvas(page) != before).any()
    page.click("#reset")
    np.testing.assert_array_equal(canvas(page), before)


@needs_viewer
def test_wireframe_draws_less_of_the_same_outline(page):
    solid = outline(canvas(page))
    page.click("#wireframe")
    lines = outline(canvas(page))
    assert 0.02 * solid.sum() < lines.sum() < 0.8 * solid.sum()
    assert (lines & ~solid).sum() < 0.05 * lines.sum()
    page.click("#wireframe")
    np.testing.assert_array_equal(outline(canvas(page)), solid)


@needs_viewer
def test_statistics_are_those_of_the_file(page, folder):
    page.click("#show-statistics")
    page.wait("document.getElementById('statistics').innerText.includes('1024\\nVertices shown')")
    text = page.run("return document.getElementById('statistics').innerText")
    assert "4 to 9 (5)" in text and f"{(folder / 'torus.glb').stat().st_size / 1e3:.0f} kB" in text
    assert page.run("return document.title") == TITLE


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


@needs_viewer
def test_it_is_shown_by_a_server_too(browser, folder):
    server = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=folder))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        browser.open(f"http://127.0.0.1:{server.server_port}/index.html")
        browser.wait("window.refmesh && refmesh.ready")
        assert browser.wait("refmesh.playback.playing")
    finally:
        server.shutdown()
        server.server_close()


@needs_viewer
def test_a_texture_is_shown_without_shading(browser, tmp_path):
    group = painted(torus_groups()[0])
    gray = np.full((64, 64, 3), 77, np.uint8)
    flat = replace(group, appearance=replace(group.appearance, images=(gray,)))
    page = opened(browser, written(tmp_path / "painted_web", [flat]))
    picture = canvas(page)
    inside = picture[outline(picture)]
    assert np.abs(np.median(inside, axis=0) - 77).max() <= 2


@needs_viewer
def test_a_missing_file_is_told_on_the_page(browser, folder, tmp_path):
    broken = shutil.copytree(folder, tmp_path / "broken_web")
    (broken / "torus.glb.js").unlink()
    browser.open((broken / "index.html").as_uri())
    browser.wait("window.refmesh && refmesh.error")
    message = browser.run("return document.getElementById('message').innerText")
    assert message == "The capture cannot be shown: torus.glb.js is missing beside the page"


def test_a_viewer_that_is_not_built_is_told_and_nothing_is_written(tmp_path, monkeypatch):
    monkeypatch.setattr(writer, "VIEWER", "absent.js")
    data, runs = encoded(torus_groups(), DIAGONAL, RATE, CHOICE)
    with pytest.raises(RefMeshError, match="run 'make web-viewer' once, which needs npm"):
        write_web_page(tmp_path / "none_web", "torus", Take(TITLE, data, runs, RATE))
    assert not list(tmp_path.iterdir())
