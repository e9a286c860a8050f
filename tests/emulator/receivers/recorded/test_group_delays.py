"""Clocks of single signals of a played receiver: each carrier has its own multiple of the group delay."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.signals import SIGNALS
from gnss_hil.emulator.receivers.recorded.receiver import observed
from gnss_hil.emulator.receivers.recorded.tracks import Tracks
from tests.support import emulated

GAMMA = (77 / 60) ** 2  # IS-GPS-200, 20.3.3.3.3.2
T_GD_M = -3.3


def clocks_m(*names):
    """clock_m of signals of G07, which has a group delay, without the drift on the way."""
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
    craft = SimpleNamespace(tracks=rows, bounds=np.array((0, count)))
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
