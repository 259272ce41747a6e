"""Pictures of every kind become eight-bit red, green and blue, or are refused in message."""

import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.io import images
from refmesh_addon.io.images import decoded, write_image
from refmesh_addon.io.regular_files import read_regular
from tests.io.colored import encoded, picture

GRADIENT = np.arange(256, dtype=np.uint8).reshape(16, 16)


def test_gray_is_repeated():
    assert (decoded(encoded(GRADIENT), "a") == GRADIENT[:, :, None]).all()


def test_sixteen_bit_gray_is_brought_to_eight():
    assert (decoded(encoded(GRADIENT.astype(np.uint16) * 257), "a") == GRADIENT[:, :, None]).all()


@pytest.mark.parametrize(("kind", "channels"), [(2, 3), (4, 2), (6, 4)])
def test_sixteen_bit_color_and_alpha_are_brought_to_eight(kind, channels):
    """kind : of the PNG: color, gray with alpha, color with alpha."""
    pixels = np.random.default_rng(0).integers(0, 256, (16, 16, channels), dtype=np.uint8)
    expected = pixels[:, :, :3] if channels > 2 else pixels[:, :, :1]
    assert (decoded(sixteen_bit_png(pixels, kind), "a") == expected).all()


def sixteen_bit_png(pixels: np.ndarray, kind: int) -> bytes:
    """Each of (H, W, C) uint8 values twice, as both bytes of 16 bits."""
    rows = b"".join(b"\0" + (row.astype(">u2") * 257).astype(">u2").tobytes() for row in pixels)
    head = struct.pack(">IIBBBBB", pixels.shape[1], pixels.shape[0], 16, kind, 0, 0, 0)
    chunks = ((b"IHDR", head), (b"IDAT", zlib.compress(rows)), (b"IEND", b""))
    parts = [struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data)) for name, data in chunks]
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


@pytest.mark.parametrize("kind", ["PNG", "JPEG"])
def test_picture_of_sixteen_thousand_pixels_is_halved(kind):
    rows = np.linspace(0, 255, 16384).astype(np.uint8)
    pixels = np.repeat(np.repeat(rows[None, :, None], 16, axis=0), 3, axis=2)
    halved = decoded(encoded(pixels, kind), "a")
    assert halved.shape == (8, 8192, 3)
    assert np.abs(halved[0, :, 0].astype(int) - rows[::2]).max() <= 2


def test_alpha_goes_and_color_stays_below_it():
    pixels = np.dstack([picture(16), GRADIENT])
    assert (decoded(encoded(pixels), "a") == picture(16)).all()


def test_palette_keeps_its_colors(tmp_path):
    Image.fromarray(picture(16)).quantize(4).save(tmp_path / "a.png")
    assert (decoded((tmp_path / "a.png").read_bytes(), "a") == picture(16)).all()


def test_truncated_picture_is_refused():
    noise = np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    with pytest.raises(RefMeshError, match="skin.png.*cut off"):
        decoded(encoded(noise)[:5000], "skin.png")


def test_large_picture_is_halved(monkeypatch):
    monkeypatch.setattr(images, "LARGEST", 8)
    assert (decoded(encoded(picture(32)), "a") == picture(8)).all()


def test_huge_picture_is_refused_before_it_is_decoded(monkeypatch):
    monkeypatch.setattr(images, "MOST", 16)
    with pytest.raises(RefMeshError, match="32 x 32 pixels, more than 16"):
        decoded(encoded(picture(32))[:200], "a")


def test_png_is_exact_and_repeatable(tmp_path):
    for name in ("a.png", "b.png"):
        write_image(tmp_path / name, picture(16))
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert (decoded((tmp_path / "a.png").read_bytes(), "a") == picture(16)).all()


def test_jpeg_is_close(tmp_path):
    smooth = np.dstack([GRADIENT, GRADIENT.T, GRADIENT // 2])
    write_image(tmp_path / "a.jpg", smooth)
    assert np.abs(decoded((tmp_path / "a.jpg").read_bytes(), "a").astype(int) - smooth).mean() < 6


def test_folder_is_no_regular_file(tmp_path):
    with pytest.raises(OSError, match="not a regular file"):
        read_regular(tmp_path)
