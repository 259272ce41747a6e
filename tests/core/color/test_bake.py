"""Baking: walks end where a search does, and a color that is known everywhere comes back."""

import numpy as np
from numpy.testing import assert_allclose

from refmesh_addon.core.color.bake import Capture, baked, placed
from refmesh_addon.core.color.raster import rasterized
from refmesh_addon.core.color.texels import Texels
from refmesh_addon.core.geometry.mesh import triangle_normals
from refmesh_addon.core.types import TriangleMesh

from .painted import cube_sphere, painted, smooth_color

MESH, LAYOUT = cube_sphere(8)
TEXELS = Texels.of(LAYOUT, 128)
SOURCE, SOURCE_LAYOUT = cube_sphere(11, turn=0.4)


def test_walks_end_where_a_search_does():
    capture = Capture(SOURCE)
    normals = triangle_normals(MESH)[TEXELS.triangles]
    walked, searched = placed(MESH, TEXELS, capture), capture.searched(TEXELS.points(MESH), normals)
    apart = np.linalg.norm(capture.at(walked) - capture.at(searched), axis=1)
    assert walked.matched.all()
    assert np.percentile(apart, 99) < 1e-5
    assert apart.max() < 0.02


def test_known_color_comes_back():
    appearance = painted(SOURCE, SOURCE_LAYOUT, 256)
    colors = baked(appearance, placed(MESH, TEXELS, Capture(SOURCE)))
    truth = smooth_color(TEXELS.points(MESH) / np.linalg.norm(TEXELS.points(MESH), axis=1, keepdims=True))
    assert np.abs(colors.astype(int) - truth).max() <= 12
    assert np.abs(colors.astype(int) - truth).mean() < 1.5


def test_same_triangles_give_the_picture_back():
    appearance = painted(MESH, LAYOUT, 128)
    colors = baked(appearance, placed(MESH, TEXELS, Capture(MESH)))
    covered = rasterized(LAYOUT.pixels(128), 128, 128).pixels
    found, truth = (image.reshape(-1, 3) for image in (TEXELS.image(colors), appearance.images[0]))
    assert_allclose(found[covered], truth[covered], atol=1)
    assert_allclose(found[TEXELS.pixels], truth[TEXELS.pixels], atol=4)  # beside a chart, from the next one, not from the plane of this one


def test_back_of_a_thin_part_is_not_taken_for_its_front():
    """A shell of two walls: the inner one is nearer, but faces the other way."""
    inner = TriangleMesh(SOURCE.vertices * 0.995, SOURCE.triangles[:, ::-1])
    count = len(SOURCE.triangles)
    triangles = np.concatenate([SOURCE.triangles, inner.triangles + len(SOURCE.vertices)])
    both = TriangleMesh(np.concatenate([SOURCE.vertices, inner.vertices]), triangles)
    shrunk = MESH.moved(MESH.vertices * 0.996)
    places = placed(shrunk, TEXELS, Capture(both))
    assert places.matched.all()
    assert (places.triangles < count).all()


def test_surface_that_the_capture_does_not_have_is_not_matched():
    """Half a ball: the other half finds nothing that faces its way nearby."""
    half = TriangleMesh(SOURCE.vertices, SOURCE.triangles[SOURCE.vertices[SOURCE.triangles][:, :, 2].mean(axis=1) > 0])
    matched = placed(MESH, TEXELS, Capture(half)).matched
    height = TEXELS.points(MESH)[:, 2]
    assert matched[height > 0.05].all()
    assert not matched[height < -0.3].any()
