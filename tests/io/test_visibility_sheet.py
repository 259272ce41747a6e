"""The picture of visibilities: a PNG that others read, with each vertex of each frame in its place."""

import numpy as np
import pytest
from PIL import Image

from refmesh_addon.io.visibility_sheet import WIDTH, rows_per_frame, write_visibility


@pytest.mark.parametrize("vertices", [1, WIDTH, WIDTH + 1, 10_000])
def test_each_value_is_in_its_pixel(tmp_path, vertices):
    values = np.random.default_rng(0).random((3, vertices)).astype(np.float32)
    write_visibility(tmp_path / "sheet.png", iter(values), vertices, 3)
    with Image.open(tmp_path / "sheet.png") as image:
        assert image.mode == "L"
        pixels = np.array(image)
    assert pixels.shape == (3 * rows_per_frame(vertices), WIDTH)
    stored = pixels.reshape(3, -1)
    np.testing.assert_allclose(stored[:, :vertices] / 255, values, atol=0.5 / 255 + 1e-6)
    assert not stored[:, vertices:].any()


def test_equal_values_give_equal_bytes_and_wrong_numbers_are_refused(tmp_path):
    values = np.ones((2, 10))
    for name in ("one", "other"):
        write_visibility(tmp_path / name, iter(values), 10, 2)
    assert (tmp_path / "one").read_bytes() == (tmp_path / "other").read_bytes()
    with pytest.raises(ValueError, match="2 frames were given"):
        write_visibility(tmp_path / "short", iter(values), 10, 3)
    with pytest.raises(ValueError, match=r"must be \(11,\)"):
        write_visibility(tmp_path / "long", iter(values), 11, 2)
    assert not (tmp_path / "short").exists() and not (tmp_path / "long").exists()
