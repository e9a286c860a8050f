"""Code biases: signs by published programs, sizes as they were fitted, what belongs to whom."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites
from gnss_hil.emulator.error_models.code_bias import CodeBias, signal_code_m
from gnss_hil.emulator.error_models.interchannel_bias import FREQUENCIES, InterchannelBias, receiver_code_m

pytestmark = pytest.mark.verifies(
    "emulator/error_models/code_bias.py",
    "emulator/error_models/interchannel_bias.py",
    what="Sizes of code biases of satellites and receivers",
    by=(
        "fitted: P1 - C1 to IGS's 28 satellites of 2000 (0.94 ns), GLONASS frequencies to two pairs of "
        "receivers of Jiang & Lewandowski (2012) (0.02 m a number, 0.16 m); a receiver's common delay is our "
        "choice"
    ),
    status="modelled",
)

GPS = satellites.index(satellites.GPS, np.arange(1, 33))
GLONASS = satellites.index(satellites.GLONASS, np.arange(1, 25))

CC2NONCC_M = (
    -0.003, -0.282, 0.020, 0.465, -0.251, 0.167, -0.232, -0.148, 0.102, -0.361, 0.022, 0.581, 0.151, -0.209,
    -0.350, -0.301, 0.066, 0.100, -0.057, -0.473, -0.268, 0.052, 0.249, 0.386, -0.024, 0.258, 0.554, -0.214,
)  # fmt: skip
"""P1 - C1 of 28 satellites, 21 December 1999 to 3 March 2000 (J. Ray, cc2noncc.f)."""

JIANG_NS = (
    (0, 0, 0), (0, 0, 0), (1, 0.322, -0.110), (1, 0.565, -0.176), (2, 0.133, 0.026), (2, -0.092, -0.247),
    (-2, 0.411, -0.158), (3, 1.524, -0.502), (3, 1.353, -0.001), (-3, 1.359, -1.657), (-3, 1.404, -1.031),
    (4, -1.204, -2.164), (4, -1.073, -1.666), (-4, 1.755, -0.596), (5, 0.998, -0.172), (5, 0.963, -0.480),
    (6, 0.477, -1.196), (6, 0.176, -1.549), (-7, 2.498, -0.630), (-7, 2.260, -0.747),
)  # fmt: skip
"""Frequency number, biases [ns] of the links OP-PTB and SU-PTB relative to those of frequency number 0, by
satellite. Jiang & Lewandowski, Int. J. Navigation Observ. (2012) 353961, table 7."""


L1CA, L2C, L5 = 0, 4, 5
"""Values of the contract's table "Signal"."""


def satellite_code_m(parameters, seed, index):
    """Of C/A, and of the first signal of GLONASS."""
    return signal_code_m(parameters, seed, index)[L1CA]


def test_satellites_differ_by_as_much_as_the_table_that_the_default_is_fitted_to():
    drawn = np.concatenate([satellite_code_m(CodeBias(), seed, GPS) for seed in range(200)])
    assert drawn.std() == pytest.approx(np.std(CC2NONCC_M), rel=0.05)
    assert abs(drawn.mean()) < 0.02


@pytest.mark.verifies(
    "emulator/error_models/code_bias.py",
    what="Code biases of satellites: sign, tables",
    by="the correction that IGS's program cc2noncc makes takes them away",
    status="validated",
)
def test_the_published_correction_takes_a_bias_away():
    """cc2noncc adds P1 - C1 to C1, and has P1, which clocks belong to."""
    p1_c1_ns = {f"G{number:02d}": 1e9 / 299_792_458 * m for number, m in enumerate(CC2NONCC_M, start=1)}
    off_m = satellite_code_m(CodeBias(p1_c1_ns=p1_c1_ns), 1, GPS[: len(CC2NONCC_M)])
    assert off_m + CC2NONCC_M == pytest.approx(0, abs=1e-12)


def test_a_table_takes_the_place_of_draws():
    """CODE's sign: P1 - C1 = 1 ns makes C1 shorter by 0.2998 m than the P1 that clocks belong to."""
    drawn = satellite_code_m(CodeBias(), 1, GPS)
    given = satellite_code_m(CodeBias(p1_c1_ns={"G05": 1.0}), 1, GPS)
    assert given[4] == pytest.approx(-0.299792458)
    assert (np.delete(given, 4) == np.delete(drawn, 4)).all()


def test_satellites_keep_their_bias_and_glonass_has_none():
    both = satellite_code_m(CodeBias(), 1, np.concatenate((GLONASS, GPS)))
    assert not both[:24].any()
    assert (both[24:] == satellite_code_m(CodeBias(), 1, GPS)).all()


def test_codes_on_other_carriers_have_draws_of_their_own_and_the_sigma_they_were_told():
    told = CodeBias(sigma_ns=1.0, l2c_sigma_ns=2.0, l5_sigma_ns=4.0)
    drawn = (
        1e9 / 299_792_458 * np.concatenate([signal_code_m(told, seed, GPS) for seed in range(200)], axis=1)
    )
    assert drawn[[L1CA, L2C, L5]].std(axis=1) == pytest.approx([1, 2, 4], rel=0.05)
    apart = np.corrcoef(drawn[[L1CA, L2C, L5]])[np.triu_indices(3, 1)]
    assert np.abs(apart).max() < 0.06
    assert not np.delete(drawn, [L1CA, L2C, L5], axis=0).any(), (
        "clocks belong to P codes, and to L1 of GLONASS"
    )
    given = CodeBias(p1_c1_ns={"G05": 1.0})
    assert (signal_code_m(given, 1, GPS)[L2C] == signal_code_m(CodeBias(), 1, GPS)[L2C]).all()


TOLD = InterchannelBias(slope_m_per_channel=0.05, scatter_m=0.23, hardware_m=3.0)


def test_receivers_differ_by_frequency_as_they_were_told():
    common, by_frequency = (
        np.concatenate(parts)
        for parts in zip(*(receiver_code_m(TOLD, 1, key, 4) for key in range(500)), strict=True)
    )
    assert by_frequency.shape == (2000, len(FREQUENCIES)) == (2000, 21)
    assert common.std() == pytest.approx(3.0, rel=0.06)
    expected = np.sqrt((0.05 * FREQUENCIES) ** 2 + 0.23**2)
    assert by_frequency.std(axis=0) == pytest.approx(expected, rel=0.08)
    assert np.corrcoef(by_frequency[:, 0], by_frequency[:, -1])[0, 1] < -0.5  # a slope, not scatter alone


def test_two_receivers_differ_by_as_much_as_the_pairs_that_the_defaults_are_fitted_to():
    """Lines through the differences of emulated receivers against those through the published ones, rms.

    Scatter leans lines, too: of the published slopes of 0.032 m rms it makes a third of the variance.
    """
    number, *pairs_ns = np.array(JIANG_NS).T
    published = lines(number, 0.299792458 * np.array(pairs_ns))
    column = np.searchsorted(FREQUENCIES, number)
    by_frequency = [receiver_code_m(InterchannelBias(), 1, key, 2)[1][:, column] for key in range(2000)]
    found = lines(number, np.array([one - other for one, other in by_frequency]))
    assert found == pytest.approx(published, rel=0.1)


def lines(number, bias_m):
    """Rms of slopes [m per channel] and of scatter about lines through biases (pairs, satellites)."""
    fits = [np.polyfit(number, row, 1) for row in bias_m]
    left = [row - np.polyval(fit, number) for row, fit in zip(bias_m, fits, strict=True)]
    return np.sqrt(np.mean([fit[0] ** 2 for fit in fits])), np.sqrt(np.mean(np.var(left, axis=1, ddof=2)))


def test_receivers_keep_their_biases_when_others_are_added():
    few, many = (receiver_code_m(InterchannelBias(), 3, 4, m) for m in (2, 8))
    assert (few[0] == many[0][:2]).all()
    assert (few[1] == many[1][:2]).all()


def test_a_receivers_other_signals_differ_from_its_first_by_a_constant_and_by_frequencies_of_their_own():
    """Over seeds: the difference of the common delays has the sigma told, frequencies are drawn anew."""
    told = InterchannelBias(slope_m_per_channel=0.05, scatter_m=0.23, hardware_m=3.0, band_m=0.4)
    drawn = [[receiver_code_m(told, seed, 7, 4, number) for number in (0, 6)] for seed in range(400)]
    first, second = (np.array([pair[k][0] for pair in drawn]) for k in (0, 1))
    assert (second - first).std() == pytest.approx(0.4, rel=0.06)
    assert second.std() == pytest.approx(np.hypot(3.0, 0.4), rel=0.06)
    one, two = (np.array([pair[k][1] for pair in drawn]) for k in (0, 1))
    assert one.std() == pytest.approx(two.std(), rel=0.06)
    assert abs(np.corrcoef(one.ravel(), two.ravel())[0, 1]) < 0.06
    plain = receiver_code_m(told, 1, 7, 4)
    assert all((a == b).all() for a, b in zip(plain, receiver_code_m(told, 1, 7, 4, 0), strict=True))
