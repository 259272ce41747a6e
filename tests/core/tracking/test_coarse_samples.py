"""A volume in fewer samples: the same mass in the same place."""

from numpy.testing import assert_allclose

from refmesh_addon.core.tracking.coarse_samples import SAMPLES_PER_CENTER, coarse_samples
from refmesh_addon.core.tracking.volume import sample_volume

from .rigid_sequence import BODY, COUNT


def test_coarse_samples_keep_the_mass_and_its_place_and_are_few():
    volume = sample_volume(BODY, 96, COUNT)
    samples, finest = coarse_samples(volume, COUNT), volume.finest
    assert samples.masses.sum() == finest.masses.sum()
    assert_allclose(samples.masses @ samples.positions, finest.masses @ finest.positions)
    assert 0.8 * SAMPLES_PER_CENTER * COUNT < len(samples.masses) < 2 * SAMPLES_PER_CENTER * COUNT < len(finest.masses)
    assert coarse_samples(volume, 10**6) is finest
