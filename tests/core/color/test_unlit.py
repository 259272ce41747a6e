"""Unlit pictures: what is in front is seen, and errors have their closed forms."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from refmesh_addon.core.color.appearance import Appearance
from refmesh_addon.core.color.unlit import LUMA, Camera, antialiased, eight_views, picture_error, rendered, similarity
from refmesh_addon.core.types import TriangleMesh

from .painted import cube_sphere, painted


def plain(mesh, color) -> Appearance:
    count = len(mesh.triangles)
    colors = np.broadcast_to(np.array(color, np.uint8), (count, 3, 3)).copy()
    return Appearance(mesh, np.zeros((count, 3, 2), np.float32), np.full(count, -1), colors)


def square(z):
    return TriangleMesh([[-1, -1, z], [1, -1, z], [1, 1, z], [-1, 1, z]], [[0, 1, 2], [0, 2, 3]])


@pytest.mark.parametrize("turn, front", [(0.0, 200), (np.pi, 50)])
def test_nearest_surface_is_seen(turn, front):
    near, far = plain(square(0.1), (200,) * 3), plain(square(-0.1), (50,) * 3)
    triangles = np.concatenate([near.mesh.triangles, far.mesh.triangles + 4])
    mesh = TriangleMesh(np.concatenate([near.mesh.vertices, far.mesh.vertices]), triangles)
    both = Appearance(mesh, np.zeros((4, 3, 2), np.float32), np.full(4, -1), np.concatenate([near.colors, far.colors]))
    picture = rendered(both, Camera.around(mesh, 32, Rotation.from_euler("y", turn)))
    assert set(np.unique(picture.colors[picture.covered])) == {front}


def test_outline_of_a_ball_is_a_disc():
    mesh, layout = cube_sphere(24)
    camera = Camera.around(mesh, 200, eight_views()[3])
    covered = rendered(painted(mesh, layout, 64), camera).covered.sum()
    assert covered == pytest.approx(np.pi * camera.scale**2, rel=0.01)


def test_error_of_a_shift_in_brightness_has_its_closed_form():
    error = picture_error(plain(square(0), (100,) * 3), plain(square(0), (110,) * 3), 64, [Rotation.identity()])
    assert error.psnr == pytest.approx(20 * np.log10(255 / 10))
    assert error.picture_psnr > error.psnr
    assert error.ssim < 1.0


def test_equal_surfaces_have_no_error():
    error = picture_error(plain(square(0), (9, 8, 7)), plain(square(0), (9, 8, 7)), 64, eight_views()[:2])
    assert error.psnr == np.inf and error.ssim == pytest.approx(1.0)


def test_similarity_is_symmetric_and_falls_with_noise():
    rng = np.random.default_rng(0)
    one = rng.uniform(0, 255, (32, 32))
    little, much = one + rng.normal(0, 5, one.shape), one + rng.normal(0, 50, one.shape)
    np.testing.assert_allclose(similarity(one, much), similarity(much, one))
    assert similarity(one, one).min() == pytest.approx(1.0)
    assert similarity(one, little).mean() > similarity(one, much).mean()


def test_pixels_of_an_outline_are_mixed():
    """A square turned by an angle: its covered area is that of the pixels' shares, to a fraction of the hard picture's error."""
    mesh = square(0)
    camera = Camera.around(mesh, 40, Rotation.from_euler("z", 0.3))
    picture = antialiased(plain(mesh, (200,) * 3), camera)
    assert set(np.unique(picture.covered)) == {0.0, 0.25, 0.5, 0.75, 1.0}
    np.testing.assert_allclose(picture.colors[..., 0], 200 * picture.covered)
    assert picture.covered.sum() == pytest.approx(4 * camera.scale**2, rel=0.01)


def test_error_is_that_of_whole_pictures_compared_pixel_by_pixel():
    """The box around both surfaces is all that is compared; beyond it both are black."""
    mesh, layout = cube_sphere(8)
    one, other = painted(mesh, layout, 64), plain(mesh.moved(mesh.vertices * 0.9), (90, 120, 60))
    camera = Camera.around(mesh, 96, eight_views()[2])
    first, second = antialiased(one, camera), antialiased(other, camera)
    error = picture_error(one, other, 96, eight_views()[2:3])
    mean_square = ((first.colors - second.colors) ** 2).mean()
    assert error.picture_psnr == pytest.approx(10 * np.log10(255**2 / mean_square), abs=1e-3)
    assert error.picture_ssim == pytest.approx(similarity(first.colors @ LUMA, second.colors @ LUMA).mean(), abs=1e-3)
