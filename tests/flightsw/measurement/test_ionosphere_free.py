"""Several signals of a satellite: one of them counts, or two become a range without ionosphere.

The delays are those of an electron content, 40.3 TEC / f^2 [m], longer for codes and shorter for carriers;
carriers are written here as multiples of 10.23 MHz and of GLONASS channels.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from gnss_hil.dbc.common import vehicle
from gnss_hil.dbc.contract.values import VALUES
from gnss_hil.flightsw.app.config import configure
from gnss_hil.flightsw.measurement.ionosphere_free import ionosphere_free, paired
from gnss_hil.flightsw.measurement.observables import of_one_signal
from gnss_hil.flightsw.records.epoch import Measurements
from gnss_hil.flightsw.records.solution import NoFix
from tests.support import synthetic_epochs as s
from tests.support.budgets import BUDGET
from tests.support.flights import fly, soyuz, status, used
from tests.support.flown import FakeBus, channel_frames, decoded, position_of

_SHIPPED = vehicle.load(vehicle.find("soyuz-ms"))
SOYUZ = replace(_SHIPPED, channels=np.full(4, 32))
SKY = s.constellation()
SIGNAL = {label: raw for raw, label in VALUES["Signal"].items()}
HZ = {
    "L1CA": 154 * 10.23e6,
    "L1P": 154 * 10.23e6,
    "L2P": 120 * 10.23e6,
    "L2C": 120 * 10.23e6,
    "L5": 115 * 10.23e6,
}
GROUP_M = {"L1CA": 3, "L1P": -2, "L2P": 5, "L2C": -4, "L1OF": 1, "L2OF": -6}
SECOND = 16
"""Channels from here on have the second signal."""


def frequency(sat):
    return sat % 14 - 7


def carrier(name, sat):
    if name in HZ:
        return HZ[name]
    return {"L1OF": 1602e6, "L2OF": 1246e6}[name] + frequency(sat) * {"L1OF": 562.5e3, "L2OF": 437.5e3}[name]


def through(o, k, name):
    """Row k of `synthetic.observe` as a signal brings it through the ionosphere.

    The signal left later or earlier by the difference of delays, and has a group delay of its own, in its
    pseudorange and in the clock the receiver knows.
    """
    sat = int(o["sat"][k])
    tec, tec_per_s = (1 + sat * 7 % 10) * 2e17, (sat * 3 % 7 - 3) * 1e15
    delay_m, rate_mps = (40.3 * t / carrier(name, sat) ** 2 for t in (tec, tec_per_s))
    group_m = (GROUP_M[name] + sat % 5) * 0.7
    row = {key: value[k : k + 1].copy() for key, value in o.items()}
    row["p"] += delay_m + group_m
    row["pdot"] -= rate_mps
    row["clock"] -= group_m
    for axis in "xyz":
        row[axis] -= row[f"v{axis}"] * delay_m / s.C
    return row


class TwoBands(FakeBus):
    """Every satellite on two channels; those of `alone` on the first only."""

    gps, glonass, alone = ("L1P", "L2P"), ("L1OF", "L2OF"), ()

    def deliver(self, receiver, channel, o, k):
        sat = int(o["sat"][k])
        parts = []
        for at, name in zip(
            (channel, channel + SECOND), self.glonass if sat >= 64 else self.gps, strict=True
        ):
            if at >= SECOND and sat in self.alone:
                continue
            more = {"signal": SIGNAL[name], "frequency": frequency(sat) if sat >= 64 else 0}
            parts += channel_frames(receiver, at, through(o, k, name), 0, **more)
        return parts


def fixes(bus, epochs=3, policy="prototype", **options):
    states, answers, _ = fly(bus, configure(SOYUZ, policy, options), epochs)
    return states, answers


def error_m(bus, answer, t):
    return np.linalg.norm(position_of(answer) - s.truth_ecef(bus.craft, float(t))[0])


@pytest.mark.slow
@pytest.mark.parametrize("gps", [("L1P", "L2P"), ("L1CA", "L2C"), ("L1CA", "L2P")])
@pytest.mark.parametrize("policy", ["prototype", "single"])
def test_tens_of_metres_of_delay_leave_the_fix_where_it_is(policy, gps):
    craft = soyuz()
    if policy == "single":  # has no lever arms
        craft = replace(craft, lever_body=np.zeros((4, 3)))
    bus = TwoBands(craft, SKY, channels=12)
    bus.gps = gps
    _, answers = fixes(bus, policy=policy, ionosphere_free=True)
    for t, answer in enumerate(answers):
        pdop = decoded(answer, "NAV_STATUS")["pdop"][0]
        # Steps of 0.1 mm, 29 um each, several to a range and three times as large in the combination.
        assert error_m(bus, answer, t) < 0.0006 * pdop
        v = np.array([decoded(answer, f"NAV_V{axis}")[f"v{axis.lower()}_mps"][0] for axis in "XYZ"])
        assert np.linalg.norm(v - s.truth_ecef(craft, float(t))[1]) < 0.0006 * pdop
    _, answers = fixes(bus, policy=policy, inconsistent="fix")
    assert error_m(bus, answers[0], 0) > 5, "one band alone is metres wrong"


def test_both_channels_are_in_the_list_of_used_ones():
    bus = TwoBands(soyuz(), SKY, channels=12)
    _, answers = fixes(bus, 1, ionosphere_free=True)
    channels = used(answers[0])
    assert channels == {(r, c) for r in range(1, 5) for k in range(12) for c in (k, k + SECOND)}
    assert status(answers[0], "measurements") == 96 and status(answers[0], "satellites") == 12
    _, answers = fixes(bus, 1, inconsistent="fix", exclude_satellites=0)
    assert used(answers[0]) == {(r, c) for r in range(1, 5) for c in range(12)}


def test_a_satellite_without_a_pair_is_not_used():
    bus = TwoBands(soyuz(), SKY, channels=12)
    tracked = [sat for _, _, sat in bus.tracking(0.0, 0)]
    bus.alone = tuple(tracked[:2])
    _, answers = fixes(bus, 1, ionosphere_free=True)
    assert status(answers[0], "satellites") == 10 and error_m(bus, answers[0], 0) < 0.01
    bus.alone = tuple(SKY)
    states, answers = fixes(bus, 1, ionosphere_free=True, without_pairs="no-fix")
    assert status(answers[0], "no_fix") == NoFix.TOO_FEW_SATELLITES and states[-1].single_fixes == 0


def test_without_enough_pairs_one_signal_of_each_satellite_serves_and_is_counted():
    bus = TwoBands(soyuz(), SKY, channels=12)
    tracked = [sat for _, _, sat in bus.tracking(0.0, 0)]
    bus.alone = tuple(sorted(set(tracked))[2:])
    options = {"inconsistent": "fix", "exclude_satellites": 0}
    states, answers = fixes(bus, 2, ionosphere_free=True, **options)
    assert status(answers[0], "no_fix") == NoFix.FIX and states[-1].single_fixes == 2
    assert used(answers[0]) == {(r, c) for r in range(1, 5) for c in range(12)}
    one, _ = fixes(bus, 2, **options)
    fix = states[-1].solution.fix
    assert fix.position_m.tolist() == one[-1].solution.fix.position_m.tolist()
    assert one[-1].single_fixes == 0, "pairs were not asked for"
    bus.alone = ()
    states, _ = fixes(bus, 2, ionosphere_free=True, **options)
    assert states[-1].single_fixes == 0


@pytest.mark.parametrize("policy", ["prototype", "analogue", "single"])
def test_a_second_signal_changes_nothing_where_one_counts(policy):
    craft = soyuz()
    both, first = TwoBands(craft, SKY, channels=10), TwoBands(craft, SKY, channels=10)
    first.alone = tuple(SKY)
    options = {"inconsistent": "fix"}
    two, one = (fixes(bus, 2, policy, **options)[0][-1].solution.fix for bus in (both, first))
    assert two.position_m.tolist() == one.position_m.tolist()
    assert two.covariance_m2.tolist() == one.covariance_m2.tolist() and two.satellites == one.satellites


def offered(*rows):
    """Measurements of rows (receiver, channel, satellite, signal)."""
    receiver, channel, sat, signal = (
        np.array([(r, c, sat, SIGNAL[name]) for r, c, sat, name in rows], np.int64).reshape(-1, 4).T
    )
    flat, three = np.zeros(len(sat)), np.zeros((3, len(sat)))
    return Measurements(
        receiver,
        channel,
        sat,
        flat,
        flat,
        flat + 45,
        flat,
        flat,
        flat,
        three,
        three,
        flat,
        flat,
        signal,
        flat,
    )


def test_codes_of_one_kind_pair_before_mixed_ones():
    m = offered((0, 0, 7, "L1CA"), (0, 1, 7, "L2C"), (0, 2, 7, "L2P"), (0, 3, 7, "L1P"), (0, 4, 8, "L2P"),
                (0, 5, 8, "L1CA"), (1, 0, 7, "L1CA"), (1, 1, 7, "L5"), (1, 2, 9, "L2P"), (0, 6, 9, "L1P"),
                (0, 7, 70, "L2OF"), (0, 8, 70, "L1OF"), (1, 3, 10, "L1CA"), (1, 4, 10, "L1P"))  # fmt: skip
    first, second = paired(m)
    assert list(zip(first.tolist(), second.tolist(), strict=True)) == [(3, 2), (5, 4), (6, 7), (11, 10)]
    assert of_one_signal(m, BUDGET).channels.tolist() == [1 << c for c in (0, 5, 0, 2, 6, 8, 3)]


@pytest.mark.verifies(
    "flightsw/measurement/ionosphere_free.py",
    "flightsw/measurement/signals.py",
    what="Range without ionosphere",
    by=(
        "delays of 40.3 TEC / f^2 with carriers written apart; noise factor 2.978 of another library's "
        "documentation"
    ),
    status="validated",
)
def test_noise_of_the_pair_is_the_textbooks():
    """By the squares of Navipedia's coefficients ("Ionosphere-free Combination for Dual Frequency Receivers",
    eq. 1) in fractions; the factor 2.978 is quoted in the documentation of Orbis.GNSS.IonosphereFree.
    """
    m = offered((0, 0, 7, "L1P"), (0, 1, 7, "L2P"))
    apart, pair = of_one_signal(m, BUDGET), ionosphere_free(m, BUDGET)
    g = Fraction(77, 60) ** 2
    factor = float((g**2 + 1) / (g - 1) ** 2)
    assert factor**0.5 == pytest.approx(2.978, abs=5e-4)
    assert pair.code_variance_m2[0] == pytest.approx(factor * apart.code_variance_m2[0], rel=1e-12)
    # A loop's noise is one of phase: of the longer wave it is more metres a second.
    longer = float((g**2 + g) / (g - 1) ** 2)
    assert pair.rate_variance_m2ps2[0] == pytest.approx(longer * apart.rate_variance_m2ps2[0], rel=1e-3)


def test_weights_follow_each_signals_own_noise():
    m = offered((0, 0, 7, "L1P"), (0, 1, 7, "L2P"))
    weak = replace(m, cn0_dbhz=np.array([45.0, 35.0]))
    v1, v2 = (of_one_signal(offered((0, 0, 7, "L1P")), BUDGET).code_variance_m2[0] * n for n in (1, 10))
    assert ionosphere_free(weak, BUDGET).code_variance_m2[0] == pytest.approx(
        2.5457**2 * v1 + 1.5457**2 * v2, rel=0.02
    )


def test_nothing_offered():
    assert len(ionosphere_free(offered(), BUDGET)) == 0 == len(of_one_signal(offered(), BUDGET))
