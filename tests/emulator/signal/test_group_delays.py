"""Clocks of single signals by what satellites broadcast: factors of the interface documents."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.common.signals import SIGNALS
from gnss_hil.emulator.signal.group_delays import beyond_first_m

pytestmark = pytest.mark.verifies(
    "emulator/signal/group_delays.py",
    what="Group delays of single signals",
    by="IS-GPS-200, 20.3.3.3.3.2: gamma = (77/60)^2, and 1.7932 for L5; GLONASS ICD 5.1, 4.4: L2 is late",
    status="validated",
)

GAMMA = (77 / 60) ** 2
T_GD_M, TAU_M = np.full(1, -3.3), np.full(1, 1.7)


def beyond(name, group_m=T_GD_M, band_m=TAU_M):
    return float(beyond_first_m(np.array([SIGNALS[name].value]), group_m, band_m)[0])


@pytest.mark.parametrize(
    ("name", "gamma"),
    [("L1CA", 1), ("L1P", 1), ("L2P", GAMMA), ("L2C", GAMMA), ("L5", (154 / 115) ** 2)],
)
def test_a_gps_clock_is_that_of_two_frequencies_less_gamma_times_the_delay(name, gamma):
    of_two_m = T_GD_M[0]  # beyond the clock of L1, which has it taken off once
    assert beyond(name) == pytest.approx(of_two_m - gamma * T_GD_M[0], abs=1e-9)


def test_a_glonass_clock_is_that_of_l1_and_what_leaves_late_on_l2_comes_late():
    """ICD 4.4: Delta tau_n = t_f2 - t_f1, delays of the equipment. Late is a clock behind."""
    assert beyond("L1OF") == 0 and beyond("L2OF") == -TAU_M[0]
    assert beyond("L2OF", group_m=np.full(1, 99.0)) == -TAU_M[0]
