"""Keyed draws: the generator's published vectors, independence of everything that must not matter."""

import numpy as np
import pytest
from scipy import stats
from scipy.special import ndtri

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.limits import MAX_RECEIVERS
from gnss_hil.emulator.numerics import keyed_draws
from gnss_hil.emulator.numerics.keyed_draws import Stream


@pytest.mark.verifies(
    "emulator/numerics/keyed_draws.py",
    "emulator/numerics/recursion.py",
    what="Keyed draws, states that walk",
    by="NumPy's Philox 4x64-10 gives the published vector; how draws are keyed is ours",
    status="modelled",
)
def test_generator_is_philox_4x64_10():
    """Random123's known answer (kat_vectors): philox4x64-10, counter and key zero. NumPy counts up before
    it draws, so the counter before zero is asked for."""
    known = [0x16554D9ECA36314C, 0xDB20FE9D672D0FDC, 0xD7E772CEE186176B, 0x7E68B68AEC7BA23B]
    generator = np.random.Philox(key=(0, 0), counter=[2**64 - 1] * 4)
    assert generator.random_raw(4).tolist() == known


def signals(epochs=range(3), receivers=range(2), systems=range(1)):
    """Epoch, receiver, satellite index and first signal (p,) of all there are."""
    sats = np.concatenate([satellites.index(system, np.arange(satellites.NUMBERS)) for system in systems])
    found = np.meshgrid(np.array(epochs), np.array(receivers), sats, indexing="ij")
    epoch, receiver, sat = (column.reshape(-1) for column in found)
    return epoch, receiver, sat, satellites.system_of(sat)


def test_a_draw_stays_whatever_else_is_asked_for():
    """One signal alone, with others, in another order, of more systems, at another place of the stretch."""
    stream = Stream(5, 99, "noise")
    at = signals(range(60, 70), range(MAX_RECEIVERS), range(2))
    every = stream.of_signals(*at)
    some = np.random.default_rng(1).permutation(len(every))[:50]
    assert (stream.of_signals(*(column[some] for column in at)) == every[some]).all()
    for one in some[:5]:
        assert stream.of_signals(*(column[[one]] for column in at)) == every[one]
    assert len(np.unique(every)) == len(every)


def test_a_satellites_signals_have_draws_of_their_own():
    """L1 C/A and L2C of GPS, L1OF and L2OF of GLONASS, by their values on the bus."""
    stream = Stream(5, 99, "noise")
    *at, first = signals(range(60, 70), range(MAX_RECEIVERS), range(2))
    one, two = stream.of_signals(*at, first), stream.of_signals(*at, np.array([4, 6])[first])
    assert len(np.unique(np.concatenate((one, two)))) == 2 * len(one)
    assert abs(np.corrcoef(keyed_draws.normal(one), keyed_draws.normal(two))[0, 1]) < 4 / np.sqrt(len(one))


@pytest.mark.parametrize("other", [(6, 99, "noise"), (5, 2**64 - 1, "noise"), (5, 99, "slips")])
def test_every_part_of_the_key_counts(other):
    """A change of seed, owner or model shares no word with the original; nor do epochs with each other."""
    at = signals()
    one, two = Stream(5, 99, "noise"), Stream(*other)
    assert not np.isin(one.of_signals(*at), two.of_signals(*at)).any()
    assert not np.isin(one.words(7, 100), two.words(7, 100)).any()
    assert not np.isin(one.of_epoch(7, 100), two.of_epoch(7, 100)).any()
    assert not np.isin(one.of_epoch(7, 100), one.of_epoch(8, 100)).any()


def test_owners_that_differ_in_their_last_bit_differ():
    one, two = (Stream(1, 2**63 + last, "noise").words(0, 4) for last in (0, 1))
    assert not np.isin(one, two).any()


def test_draws_are_standard_normal_and_independent():
    stream = Stream(1, 2, "noise")
    epochs = 40
    sample = keyed_draws.normal(stream.of_signals(*signals(range(epochs), range(4), range(2))))
    assert stats.kstest(sample, "norm").pvalue > 1e-3
    by_epoch = sample.reshape(epochs, -1)
    bound = 5 / np.sqrt(by_epoch.shape[1])
    assert np.abs(np.corrcoef(by_epoch) - np.eye(epochs)).max() < bound
    by_receiver = sample.reshape(epochs, 4, -1).swapaxes(0, 1).reshape(4, -1)
    assert np.abs(np.corrcoef(by_receiver) - np.eye(4)).max() < 5 / np.sqrt(by_receiver.shape[1])


def test_uniform_never_reaches_its_ends():
    ends = keyed_draws.uniform(np.array([0, 2**64 - 1], np.uint64))
    assert 0 < ends[0] < ends[1] < 1
    assert np.isfinite(keyed_draws.normal(np.array([0, 2**64 - 1], np.uint64))).all()


def test_normal_numbers_are_quantiles_of_their_words():
    """Against SciPy's inverse distribution function, far into both tails, in any shape."""
    raw = np.linspace(0, 2**64 - 2**12, 100_001).astype(np.uint64)
    edge = np.uint64(1) << np.arange(12, 64, dtype=np.uint64)
    raw = np.concatenate((raw, edge, np.uint64(2**64 - 1) - edge))
    found = keyed_draws.normal(raw[: raw.size // 5 * 5].reshape(-1, 5))
    expected = ndtri(keyed_draws.uniform(raw[: found.size])).reshape(found.shape)
    np.testing.assert_allclose(found, expected, rtol=1e-13, atol=1e-15)
