"""Run as a program: a mesh as .npz on standard input, its layout by xatlas as .npz on standard output. Imports nothing of RefMesh."""

from __future__ import annotations

import faulthandler
import io
import os
import sys

RESOLUTION = 1024  # texels along a side for which charts are packed; the layout itself has no resolution
PADDING = 2  # texels between charts at that resolution, so that filtering does not mix them


def main(time_limit: float) -> None:
    """Ends by itself after the time limit, should nobody be left to end it."""
    import numpy as np
    import xatlas

    with open(os.devnull, "w") as nowhere:
        faulthandler.dump_traceback_later(time_limit, exit=True, file=nowhere)  # from a thread of C, which xatlas cannot hold up
        mesh = np.load(io.BytesIO(sys.stdin.buffer.read()))
        atlas = xatlas.Atlas()
        atlas.add_mesh(mesh["vertices"], mesh["triangles"])
        charts, packing = xatlas.ChartOptions(), xatlas.PackOptions()
        charts.fix_winding = True
        packing.resolution, packing.padding, packing.bilinear = RESOLUTION, PADDING, True
        packing.bruteForce = True  # every place is tried: 5 to 10 % more of the texture is used, for a second or two
        packing.rotate_charts = False  # it would swap the axes, which mirrors charts
        atlas.generate(charts, packing)
        owners, triangles, uvs = atlas[0]
        if not np.array_equal(owners[triangles], mesh["triangles"]):
            sys.exit("xatlas has dropped triangles")
        result = io.BytesIO()
        np.savez(result, uvs=uvs * (np.array([atlas.width, atlas.height]) / max(atlas.width, atlas.height)), triangles=triangles)
        sys.stdout.buffer.write(result.getvalue())
        faulthandler.cancel_dump_traceback_later()


if __name__ == "__main__":
    main(float(sys.argv[1]))
