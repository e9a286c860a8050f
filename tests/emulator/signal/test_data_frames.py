"""Time to collect an ephemeris, against listening to a message bit by bit."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.dbc.common.systems import SYSTEMS
from gnss_hil.emulator.signal.data_frames import collection_ns

S = gpstime.NS_PER_S
WEEK_NS = 1712 * gpstime.NS_PER_WEEK  # 2012-10-28
LEAP_S = 16  # GPS - UTC then, IERS Bulletin C 43


def by_listening(unit_s, needed, units, starts_at):
    """Listen in steps of 0.1 s from starts_at [s] of a frame on: heard is what is heard whole."""
    t, whole, began = round(10 * starts_at), set(), None
    while True:
        unit, inside = divmod(t, 10 * unit_s)
        if inside == 0:
            began = unit
        t += 1
        if began is not None and t == 10 * unit_s * (began + 1):
            whole.add(began % units)
            if whole >= set(range(needed)):
                return t / 10 - starts_at


@pytest.mark.verifies(
    "emulator/signal/data_frames.py",
    what="Time to collect an ephemeris",
    by="listening to the frames of IS-GPS-200 and the GLONASS ICD in steps of 0.1 s",
    status="validated",
)
@pytest.mark.parametrize(
    ("system", "frame", "shift_s"),
    [(satellites.GPS, (6, 3, 5), 0), (satellites.GLONASS, (2, 4, 15), LEAP_S)],
)
def test_as_long_as_listening_takes(system, frame, shift_s):
    """IS-GPS-200, 20.3.2: five subframes of 6 s, ephemeris and clock in 1 to 3, frames with the week. GLONASS
    ICD 4.3: fifteen strings of 2 s, immediate data in 1 to 4, frames with UTC."""
    tenths = np.arange(300)
    begins_ns = WEEK_NS + 7_200 * S + shift_s * S + tenths * (S // 10)
    found = collection_ns(np.full(300, system), begins_ns)
    assert found / S == pytest.approx([by_listening(*frame, tenth / 10) for tenth in tenths])


def test_bounds():
    """GPS: 18 s at best, 36 s at worst; 18 to 30 s for who begins outside of what is needed.
    GLONASS: 8 to 32 s."""
    begins_ns = WEEK_NS + np.arange(30_000) * (S // 1000)
    gps, glonass = (collection_ns(np.full(30_000, system), begins_ns) / S for system in (0, 1))
    assert (gps.min(), glonass.min()) == (18, 8)
    assert (gps.max(), glonass.max()) == pytest.approx((36, 32), abs=0.002)
    late = gps[18_001:]
    assert (late.min(), late.max()) == pytest.approx((18, 30), abs=0.002)


def test_shapes_and_unknown_systems():
    system = np.array(((0, 1), (1, 0)))
    assert collection_ns(system, np.full((2, 2), WEEK_NS)).shape == (2, 2)
    with pytest.raises(ValueError, match="galileo"):
        collection_ns(np.array((0, SYSTEMS["galileo"].value)), np.full(2, WEEK_NS))
