"""Clocks of single signals of a played receiver: each carrier has its own multiple of the group delay."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.signals import SIGNALS
from gnss_hil.emulator.receivers.recorded import inter_signal
from gnss_hil.emulator.receivers.recorded.receiver import observed
from gnss_hil.emulator.receivers.recorded.tracks import Tracks
from tests.support import emulated

GAMMA = (77 / 60) ** 2  # IS-GPS-200, 20.3.3.3.3.2
T_GD_M = -3.3


def clocks_m(*names, isc_m=None):
    """clock_m of signals of G07, which has a group delay, without the drift on the way; isc_m by name."""
    scene = emulated.world(emulated.craft()).sky.at(1_035_676_800 * 10**9)
    n, count = len(scene.index), len(names)
    sat = np.full(count, satellites.parse("G07"))
    broadcast = replace(scene.broadcast, group_delay_m=np.full(n, T_GD_M))
    sky = replace(scene, broadcast=broadcast, clock_drift_mps=np.zeros(n))
    zeros, numbers = np.zeros(count), np.zeros(count, np.int64)
    rows = Tracks(
        epoch=numbers, channel=np.arange(count), sat=sat, signal=np.array([SIGNALS[s].value for s in names]),
        carrier_hz=np.array([SIGNALS[s].carrier_hz for s in names]), range_m=np.full(count, 2.2e7),
        rate_mps=zeros, phase_cyc=zeros, slips=numbers, half_cycle=np.zeros(count, bool), cn0_dbhz=zeros,
        dropped=0, doubtful=0,
    )  # fmt: skip
    row_of = np.full(satellites.SATELLITES, -1)
    row_of[sky.index] = np.arange(n)
    told_m = inter_signal.unknown()
    for name, value in (isc_m or {}).items():
        told_m[SIGNALS[name].value, sat[0]] = value
    craft = SimpleNamespace(tracks=rows, bounds=np.array((0, count)), inter_signal_m=told_m)
    return observed(craft, sky, row_of, 0).clock_m, float(sky.clock_m[row_of[sat[0]]])


def test_the_second_frequency_has_gamma_times_the_delay():
    """IS-GPS-200: L1 is the clock of two frequencies less T_GD, L2 less gamma T_GD."""
    (l1, l2), told_m = clocks_m("L1P", "L2P")
    two_m = told_m + T_GD_M
    assert l1 == pytest.approx(two_m - T_GD_M, abs=1e-9)
    assert l2 == pytest.approx(two_m - GAMMA * T_GD_M, abs=1e-9)


@pytest.mark.parametrize("pair", [("L1P", "L2P"), ("L1CA", "L2C")])
def test_without_the_ionosphere_no_group_delay_is_left(pair):
    """What broadcast clocks are defined by: the combination of both codes needs no T_GD."""
    (l1, l2), told_m = clocks_m(*pair)
    assert (l2 - GAMMA * l1) / (1 - GAMMA) == pytest.approx(told_m + T_GD_M, abs=1e-6)


def test_what_civil_messages_say_of_a_signal_counts():
    """IS-GPS-200, 30.3.3.3.1.1.1: the clock of a signal is that of two frequencies less T_GD plus its ISC."""
    (l1, l2, l5), told_m = clocks_m("L1CA", "L2C", "L5", isc_m={"L1CA": 0.4, "L2C": -1.7, "L5": 2.5})
    two_m = told_m + T_GD_M
    for found, isc_m in ((l1, 0.4), (l2, -1.7), (l5, 2.5)):
        assert found == pytest.approx(two_m - T_GD_M + isc_m, abs=1e-9)
