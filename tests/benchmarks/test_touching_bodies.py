"""Bodies that touch in every frame of a group, but not in all of the take: two closed bodies of the right shape."""

import numpy as np
import pytest

from benchmarks.frames import frames_folder
from benchmarks.grouped import Take, extracted, processes, tracked_take
from benchmarks.primitives import bodies, shape
from refmesh_addon.core.geometry.mesh import is_watertight, vertex_components
from refmesh_addon.core.settings import ReferenceSettings, TrackingSettings

SETTINGS = TrackingSettings(centers=300, resolution=96)
TRIANGLES = 6000


def shapes(take: Take) -> dict[str, dict]:
    """Kind -> figures, of the two closed bodies of the reference mesh of all frames."""
    with processes() as workers:
        mesh = extracted(take, ReferenceSettings(triangles=TRIANGLES), workers).mesh
    assert is_watertight(mesh)
    assert vertex_components(mesh)[0] == len(bodies(mesh)) == 2
    return {found["kind"]: found for found in map(shape, bodies(mesh))}


def test_a_ball_that_has_fallen_on_a_box(tmp_path):
    take = tracked_take(frames_folder("collide", 12, tmp_path), "", SETTINGS)
    touching = [index for index, mesh in enumerate(take.bodies) if vertex_components(mesh)[0] == 1]
    assert touching, "the frames show one closed surface while the bodies touch"
    found = shapes(take.part(touching))
    assert set(found) == {"ball", "box"}, "the ball is squashed, so how round it is says nothing"
    assert found["box"]["p99"] < 2.0, "where the ball lies, no frame shows the box"


@pytest.mark.parametrize("frames", ["16-20", "24-28"])
def test_a_real_ball_and_a_real_box(shared_data, frames):
    first, last = map(int, frames.split("-"))
    take = tracked_take(shared_data("collision"), "14-28", SETTINGS)
    found = shapes(take.part([index for index, number in enumerate(take.numbers) if first <= number <= last]))
    assert found["ball"]["p99"] < 2.0 and found["box"]["p99"] < 1.0
    assert np.isclose(found["ball"]["triangles"] + found["box"]["triangles"], TRIANGLES, rtol=0.01)
