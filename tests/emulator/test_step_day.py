"""A whole day, every five minutes, on the nominal and on the real sky: the contract holds throughout.

Epochs stand on whole minutes, where ephemerides change and signals come from the segment before.
"""

import numpy as np
import pytest

from gnss_hil.emulator import assemble
from gnss_hil.emulator.step import emulate_step
from tests.emulator.test_step import ROUNDING_M, predicted_range_m
from tests.support import emulated
from tests.support.outside import data_file

pytestmark = pytest.mark.verifies(
    "emulator/environment/signals.py",
    "emulator/receivers/observations.py",
    what="Observations",
    by="numerical derivatives; a day of frames closed against independent geometry to 0.2 mm",
    status="validated",
)

EPOCHS = range(0, 1415, 5)  # minutes, from 00:15 to the end of the day


def real_sky():
    return {
        "gps": [str(data_file("navigation/brdc3050.12n.gz"))],
        "glonass": [str(data_file("navigation/brdc3050.12g.gz"))],
    }


@pytest.mark.slow
@pytest.mark.parametrize(
    "sky",
    [pytest.param(dict, id="nominal"), pytest.param(real_sky, id="real", marks=pytest.mark.realdata)],
)
def test_a_day_of_pseudoranges(sky):
    receivers = {**emulated.QUICK, "autonomous": "boresight"}
    soyuz = emulated.craft(receivers=receivers, factors=emulated.QUIET, clock={"amplitude_ms": 1.0})
    the_world = emulated.world(soyuz, interval_s=60.0, sky=sky())
    state, worst, satellites_seen = assemble.initial_state(the_world), 0.0, set()
    for epoch in EPOCHS:
        state, sent, truth = emulate_step(the_world, state, {}, epoch)
        seen = emulated.channels(sent["soyuz"])
        worst = max(worst, np.abs(seen["pseudorange_m"] - predicted_range_m(seen, truth[0])).max())
        satellites_seen |= set(seen["sat"].tolist())
        assert len(seen["sat"]) == emulated.decode(sent["soyuz"], "STATUS")["channels_tracking"].sum()
        assert len(seen["sat"]) >= 12
        assert not seen["health"].any()
    print(f"largest closure error: {1e3 * worst:.2f} mm, {len(satellites_seen)} satellites")
    assert worst < ROUNDING_M
    assert len(satellites_seen) >= 45
