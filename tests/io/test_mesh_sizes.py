"""Bodies too far, too large or too small for the numbers that they are kept in are refused by name."""

import numpy as np
import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.io.meshes import parse_mesh
from tests.core.shapes import ball


def written(scale=1.0, offset=0.0):
    sphere = ball(1)
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in (sphere.vertices * scale + offset).tolist()]
    return "\n".join([*lines, *(f"f {a} {b} {c}" for a, b, c in sphere.triangles + 1), ""]).encode()


@pytest.mark.parametrize("scale, offset", [(1, 0), (1, 1e11), (1e-3, 1e7), (1e-25, 0), (1e25, 1e30)])
def test_sizes_and_places_that_numbers_can_hold_are_read(scale, offset):
    mesh = parse_mesh(written(scale, offset), "a.obj")
    assert np.isclose(mesh.diagonal, scale * ball(1).diagonal, rtol=1e-3)


@pytest.mark.parametrize(
    "scale, offset, reason",
    [
        (1, 1e15, "1.0e[+]15 from the origin"),
        (1, 1e13, "move it to the origin"),
        (1e-32, 0, "too small"),
        (1e31, 0, "too large"),
        (1e200, 0, "too large"),
    ],
)
def test_others_are_refused_by_name(scale, offset, reason):
    with pytest.raises(RefMeshError, match=f"^a.obj: .*{reason}"):
        parse_mesh(written(scale, offset), "a.obj")
