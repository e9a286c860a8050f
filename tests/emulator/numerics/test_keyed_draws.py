"""Keyed draws: the generator's published vectors, independence of everything that must not matter."""

import numpy as np
import pytest
from scipy import stats

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.contract.messages import MAX_RECEIVERS
from gnss_hil.emulator.numerics import keyed_draws


def test_generator_is_philox_4x64_10():
    """Random123's known answer (kat_vectors): philox4x64-10, counter and key zero. NumPy counts up before
    it draws, so the counter before zero is asked for."""
    known = [0x16554D9ECA36314C, 0xDB20FE9D672D0FDC, 0xD7E772CEE186176B, 0x7E68B68AEC7BA23B]
    generator = np.random.Philox(key=(0, 0), counter=[2**64 - 1] * 4)
    assert generator.random_raw(4).tolist() == known


def test_a_draw_stays_when_systems_are_added():
    gps = keyed_draws.grid(5, 99, 1234, 1)
    both = keyed_draws.grid(5, 99, 1234, 2)
    assert gps.shape == (1, MAX_RECEIVERS, satellites.NUMBERS, keyed_draws.SLOTS)
    assert (both[:1] == gps).all()


@pytest.mark.parametrize("other", [(6, 99, 1234), (5, 98, 1234), (5, 99, 1235)])
def test_every_part_of_the_key_counts(other):
    """A change of seed, craft or epoch shares no word with the original."""
    one, two = keyed_draws.grid(5, 99, 1234, 2), keyed_draws.grid(*other, 2)
    assert not np.isin(one, two).any()


def test_streams_do_not_overlap():
    one = keyed_draws.words(5, 99, keyed_draws.MEASUREMENTS, 0, 100)
    assert not np.isin(one, keyed_draws.words(5, 99, keyed_draws.CLOCKS, 0, 100)).any()


def test_draws_are_standard_normal_and_independent():
    sample = keyed_draws.normal(
        np.concatenate([keyed_draws.grid(1, 2, epoch, 2).reshape(-1, 4) for epoch in range(40)])
    )
    assert stats.kstest(sample.ravel(), "norm").pvalue > 1e-3
    assert np.abs(np.corrcoef(sample.T) - np.eye(4)).max() < 4 / np.sqrt(len(sample))


def test_uniform_never_reaches_its_ends():
    ends = keyed_draws.uniform(np.array([0, 2**64 - 1], np.uint64))
    assert 0 < ends[0] < ends[1] < 1
    assert np.isfinite(keyed_draws.normal(np.array([0, 2**64 - 1], np.uint64))).all()
