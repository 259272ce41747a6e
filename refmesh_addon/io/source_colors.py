"""The colors of a captured frame as Blender shows them: places in pictures that Blender loads from files, or colors of corners."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from ..core.array_layout import check_layouts

LAYOUTS = {"uvs": "(T, 3, 2) float32", "materials": "(T) int32", "colors": "(T, 3, 3) uint8"}


@dataclass(frozen=True)
class SourceColors:
    """uvs, materials, colors : of the triangles of the frame, as in `core.color.appearance.Appearance`; none for a frame without color.
    pictures : file of each picture.
    """

    uvs: Annotated[np.ndarray, LAYOUTS["uvs"]]
    materials: Annotated[np.ndarray, LAYOUTS["materials"]]
    colors: Annotated[np.ndarray, LAYOUTS["colors"]]
    pictures: tuple[str, ...]

    @property
    def nbytes(self) -> int:
        """Memory that the arrays take; pictures are Blender's."""
        return self.uvs.nbytes + self.materials.nbytes + self.colors.nbytes

    def to_arrays(self) -> dict[str, np.ndarray]:
        """As another process sends them."""
        return {**{name: getattr(self, name) for name in LAYOUTS}, "pictures": np.array(self.pictures, dtype=np.str_)}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> SourceColors:
        """Raises ValueError for arrays that do not belong together."""
        check_layouts({name: arrays[name] for name in LAYOUTS}, LAYOUTS)
        return cls(**{name: arrays[name] for name in LAYOUTS}, pictures=tuple(arrays["pictures"].tolist()))


WITHOUT_COLOR = SourceColors(np.empty((0, 3, 2), np.float32), np.empty(0, np.int32), np.empty((0, 3, 3), np.uint8), ())


def read_source_colors(path: Path, folder: Path) -> SourceColors:
    """Colors of a frame; all its pictures have been decoded once, so that only sound ones are shown.

    folder : pictures go there, as PNG, that are inside the frame's file, or larger than LARGEST and thus reduced.
    Raises RefMeshError when the frame cannot be read; a frame with damaged colors has none.
    """
    from .appearance import read_appearance  # late: SciPy comes with these, and may be missing
    from .images import LARGEST, write_image
    from .meshes import read_bytes

    data = read_bytes(path)
    appearance, files = read_appearance(data, path)
    if appearance is None:
        return WITHOUT_COLOR
    beside = len(files.pictures) == len(appearance.images)
    pictures = []
    for index, image in enumerate(appearance.images):
        if beside and max(image.shape) < LARGEST:
            pictures.append(str(files.pictures[index]))
            continue
        name = hashlib.blake2b(f"{path.absolute()}:{path.stat().st_ctime_ns}".encode(), digest_size=8).hexdigest()
        pictures.append(str(folder / f"{name}_{index}.png"))
        if not Path(pictures[-1]).exists():
            write_image(pictures[-1], image)
    uvs, materials = appearance.uvs.astype(np.float32), appearance.materials.astype(np.int32)
    return SourceColors(uvs, materials, appearance.colors.astype(np.uint8), tuple(pictures))
