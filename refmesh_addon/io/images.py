"""Pictures in and out, by Pillow, which only the worker process loads."""

from __future__ import annotations

import io
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from ..core.errors import RefMeshError
from .files import atomic_file

EXTENSIONS = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".tga", ".bmp", ".webp")
LARGEST = 8192  # pixels along a side that are kept: 200 MB; larger pictures are halved until they fit
MOST = 16384  # pixels along a side that are read at all: 800 MB
# Pixels that any file may have, and that each of its bytes may stand for beyond: a picture of one color has 340 as a PNG.
FREE_PIXELS, PIXELS_PER_BYTE = 4096 * 4096, 400
JPEG_QUALITY = 95
WEBP_QUALITY, WEBP_EFFORT = 85, 4  # for the web, where size counts more; 6 is the greatest effort
PNG_EFFORT = 3  # of zlib, 0 to 9: beyond that files shrink by a few percent and take twice as long

_JPEG = "JPEG", {"quality": JPEG_QUALITY, "subsampling": 0}
_ENCODERS: dict[str, tuple[str, dict]] = {
    ".png": ("PNG", {"compress_level": PNG_EFFORT}),
    ".jpg": _JPEG,
    ".jpeg": _JPEG,
    ".webp": ("WEBP", {"quality": WEBP_QUALITY, "method": WEBP_EFFORT}),
}


def images_available() -> bool:
    """Whether Pillow is installed; looks without loading it."""
    return find_spec("PIL") is not None


def decoded(data: bytes, name: str) -> np.ndarray:
    """(H, W, 3) uint8, first row at the top, of an encoded picture: 16 bit are brought to 8, gray becomes red, green and blue, alpha goes.

    Sides beyond LARGEST are halved, by the mean of four pixels. Raises RefMeshError, with `name`, for what cannot be decoded, is
    larger than MOST, or has more pixels than its bytes can stand for, which is not decoded at all.
    """
    from PIL import Image, UnidentifiedImageError  # late: without Pillow everything but color works

    previous, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None  # the limit is ours, below
    try:
        with Image.open(io.BytesIO(data)) as image:
            if max(image.size) > MOST:
                raise RefMeshError(f"{name}: is {image.width} x {image.height} pixels, more than {MOST}; make it smaller")
            check_pixels(image.width * image.height, len(data), name)
            image.draft("RGB", (LARGEST, LARGEST))  # what JPEG can leave out while decoding
            return eight_bits(image)
    except UnidentifiedImageError as error:
        raise RefMeshError(f"{name}: is not a picture that can be read; save it as PNG or JPEG") from error
    except (OSError, SyntaxError, ValueError, EOFError) as error:  # what Pillow's decoders raise on damaged data
        raise RefMeshError(f"{name}: cannot be decoded ({error}); is it cut off? Export it again") from error
    finally:
        Image.MAX_IMAGE_PIXELS = previous


def check_pixels(pixels: int, size: int, name: str) -> None:
    """Raises RefMeshError, with `name`, for pictures of so many pixels in so many bytes: decoded, they would fill the memory."""
    if pixels > max(FREE_PIXELS, PIXELS_PER_BYTE * size):
        raise RefMeshError(f"{name}: declares {pixels} pixels in {size} bytes, more than a picture of a capture would; save it again")


def eight_bits(image) -> np.ndarray:
    """(H, W, 3) uint8 of a Pillow image of any mode, as in `decoded`."""
    factor = 1
    while max(image.size) > LARGEST * factor:
        factor *= 2
    if image.mode.startswith(("I", "F")):
        return _gray(np.asarray(image), factor)
    if image.mode in ("1", "P"):  # which cannot be reduced
        image = image.convert("L" if image.mode == "1" else "RGBA")
    if factor > 1:
        image = image.reduce(factor)
    return np.array(image.convert("RGB"))


def _gray(values: np.ndarray, factor: int) -> np.ndarray:
    """Sixteen-bit integers, or floats from 0 to 1, of one channel."""
    whole = values.astype(np.float32)[::factor, ::factor]
    top = 1.0 if values.dtype.kind == "f" else 65535.0 if whole.max(initial=0) > 255 else 255.0
    channel = np.clip(np.rint(whole * (255.0 / top)), 0, 255).astype(np.uint8)
    return np.repeat(channel[:, :, None], 3, axis=2)


def encoded(pixels: np.ndarray, extension: str) -> bytes:
    """(H, W, 3) or (H, W) uint8, first row at the top, as ".png", ".jpg" or ".webp"; the same pixels give the same bytes."""
    from PIL import Image

    kind, options = _ENCODERS[extension.lower()]
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, kind, **options)
    return file.getvalue()


def write_image(path: str | Path, pixels: np.ndarray) -> None:
    """(H, W) or (H, W, 3) uint8 pixels as PNG, JPEG or WebP, by the extension. Raises RefMeshError when the file cannot be written."""
    data = encoded(pixels, Path(path).suffix)
    with atomic_file(path) as file:
        file.write(data)
