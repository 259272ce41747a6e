"""Parts of a step: together everything, none of it twice, nothing before or behind it."""

import numpy as np
import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.pipeline.session.cache import Cache
from refmesh_addon.pipeline.session.cached_map import cached_map
from refmesh_addon.pipeline.session.part import Part, PartDone
from refmesh_addon.pipeline.session.session import Session
from refmesh_addon.pipeline.session.stage_share import StageShare

from ..running import shared_workers
from .test_cached_map import Job, Power, raised

FIRST, STEP, LAST = StageShare("tracking", 0.5), StageShare("reference", 0.0, 0.2), StageShare("reference", 0.2)


@pytest.mark.parametrize("count", [1, 2, 3, 9])
def test_parts_share_the_units_without_overlap(count):
    parts = [Part(STEP, number, count).own(list(range(7))) for number in range(1, count + 1)]
    assert sorted(sum(parts, [])) == list(range(7))


def test_a_part_does_its_units_and_stops(tmp_path):
    job = Job(tmp_path)

    def run(share, number, *exponents):
        session = Session(tmp_path, Cache(tmp_path), shared_workers(), job.notify, part=Part(STEP, number, 2))
        return cached_map(session, raised, job.units(*exponents), Power, share)

    with pytest.raises(RefMeshError, match="an earlier step of the job is not complete"):
        run(FIRST, 1, 0, 1)
    with pytest.raises(PartDone):
        run(STEP, 1, 0, 1, 2, 3)
    assert sorted(job.asked) == [0, 2]
    with pytest.raises(PartDone):
        run(LAST, 1, 8, 9)
    with pytest.raises(PartDone):
        run(STEP, 2, 0, 1, 2, 3)
    assert sorted(job.asked) == [0, 1, 2, 3]
    np.testing.assert_array_equal(run(FIRST, 1, 0, 1)["to the 1"].values, np.arange(4.0))


@pytest.mark.parametrize("number", [0, 3])
def test_a_part_that_does_not_exist_is_refused(number):
    with pytest.raises(RefMeshError, match=f"part {number} of 2"):
        Part(STEP, number, 2)
