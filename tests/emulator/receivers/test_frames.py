"""What does not fit on the bus is left out, and counted out."""

from dataclasses import fields, replace

import numpy as np
import pytest

from gnss_hil.dbc.contract.frames import WIDTH
from gnss_hil.emulator.receivers import frames
from gnss_hil.emulator.receivers.observations import Observations
from tests.support import emulated


def observations(n_channels):
    """Observations of the first channels of receivers 1 and 2 on the nominal sky."""
    receiver, channel = np.divmod(np.arange(2 * n_channels), n_channels)
    rows = np.arange(2 * n_channels)
    n = len(rows)
    values = {f.name: np.zeros(n) for f in fields(Observations)}
    values.update(
        receiver=receiver, channel=channel, row=rows, sat=rows + 1, slips=np.zeros(n, int),
        pseudorange_m=np.full(n, 2.1e7), pos_ecef_m=np.full((n, 3), 1e7), vel_ecef_mps=np.full((n, 3), 1e3),
    )  # fmt: skip
    return Observations(**values)


def part(seen):
    the_world = emulated.world()
    templates, sky = the_world.craft[0].receivers.templates, the_world.sky.at(the_world.start_ns)
    return frames.receivers_part(templates, seen, sky, np.zeros(4), np.zeros(4, int), np.zeros(4, int), 48)


@pytest.mark.parametrize(
    ("name", "value"),
    [("range_rate_mps", 13_500.0), ("pseudorange_m", 5e8), ("clock_m", 1e6), ("phase_cyc", np.nan)],
)
def test_a_channel_with_a_value_that_does_not_fit_is_left_out_whole(name, value):
    seen = observations(3)
    column = getattr(seen, name).copy()
    column[1] = value
    block = frames.block([part(replace(seen, **{name: column}))], 0)
    assert emulated.decode(block, "STATUS")["frames"].tolist() == [21, 31, 1, 1]
    assert emulated.decode(block, "STATUS")["channels_tracking"].tolist() == [2, 3, 0, 0]
    assert emulated.channels(block)["channel"].tolist() == [0, 2, 0, 1, 2]
    assert len(block) == 5 * 10 + 8


def test_signal_strength_saturates():
    seen = replace(observations(1), cn0_dbhz=np.array([80.0, 45.13]))
    block = frames.block([part(seen)], 0)
    assert emulated.channels(block)["cn0_dbhz"].tolist() == [63.75, 45.25]
    assert block.data.shape == (len(block), WIDTH)


def test_tags_count_ticks_of_100_ns():
    """A counter shows the last tick, before the mark and after: -1 ns is the tick before."""
    offsets_s = np.array([-100.5e-9, -1e-9, 0.0, 99.5e-9, 1_234_567.89e-9])
    assert frames.tag_offset_ns(offsets_s).tolist() == [-200, -100, 0, 0, 1_234_500]
