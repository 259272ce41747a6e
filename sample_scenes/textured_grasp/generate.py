"""Write the frames of this sample: python -m sample_scenes.textured_grasp.generate (from the repository's folder), or `make samples`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..generators.textured import TEXTURED, write_frame
from ..grasp.generate import FIRST_NUMBER, FIRST_SEED, FRAMES

FOLDER = Path(__file__).parent / "frames"
SIZE = 512  # texels along a side
PICTURES = ".jpg"  # noise makes PNG five times as large


def main() -> None:
    """The motion and the meshes of `grasp`, each frame with an atlas of its own."""
    FOLDER.mkdir(exist_ok=True)
    sequence = TEXTURED["grasp"]()
    for index, moment in enumerate(np.linspace(0.0, 1.0, FRAMES)):
        frame = sequence.frame(moment, FIRST_SEED + index, SIZE)
        write_frame(FOLDER, f"grasp_{FIRST_NUMBER + index:04d}", frame, PICTURES)


if __name__ == "__main__":
    main()
