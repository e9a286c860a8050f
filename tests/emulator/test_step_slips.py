"""Carrier phase without a slip is continuous, also where a satellite changes its ephemeris."""

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites
from tests.support import emulated
from tests.support.outside import data_file

LIGHT = 299_792_458.0
JUMP_M = 0.05
"""What counts as a jump: the rates of both ends predict a second of range to about 1 mm in low orbit."""


def steps(blocks):
    """{(receiver, channel, satellite): (range steps [m], phase steps [m], slips)} of channels that deliver
    throughout, epoch by epoch: what range and phase moved by, less what the range rates of both ends say."""
    seen = [emulated.channels(block) for block in blocks]
    names = "receiver", "channel", "sat"
    keys = [zip(*(s[name].tolist() for name in names), strict=True) for s in seen]
    rows = [{key: i for i, key in enumerate(of_epoch)} for of_epoch in keys]
    out = {}
    for key in set.intersection(*map(set, rows)):
        at = [row[key] for row in rows]
        column = {
            name: np.array([s[name][i] for s, i in zip(seen, at, strict=True)])
            for name in ("pseudorange_m", "range_rate_mps", "phase_cyc", "slips", "frequency")
        }
        glonass = satellites.system_of(key[2]) == satellites.GLONASS
        wave_m = LIGHT / (1602e6 + 562.5e3 * column["frequency"] if glonass else 1575.42e6)
        predicted_m = (column["range_rate_mps"][1:] + column["range_rate_mps"][:-1]) / 2
        out[key] = (
            np.diff(column["pseudorange_m"]) - predicted_m,
            np.diff(wave_m * column["phase_cyc"]) - predicted_m,
            np.diff(column["slips"]) % 16,
        )
    return out


def boresight():
    return emulated.craft(receivers={**emulated.QUICK, "autonomous": "boresight"}, factors=emulated.QUIET)


class Changing:
    """A sky whose satellite of one row changes its ephemeris at t_ns: another number, and a jump or none."""

    def __init__(self, sky, row, t_ns, jump_m):
        self.index = sky.index
        self._sky, self._row, self._t_ns, self._jump_m = sky, row, t_ns, jump_m

    def over(self, t_ns):
        state = self._sky.over(t_ns)
        changed = (t_ns >= self._t_ns)[:, None] & (np.arange(len(self.index)) == self._row)
        return replace(
            state,
            clock_truth_m=state.clock_truth_m - changed * self._jump_m,
            broadcast=replace(state.broadcast, ephemeris=state.broadcast.ephemeris + changed),
        )


@pytest.mark.parametrize("jump_m", [0.0, 0.5])
def test_a_new_ephemeris_is_one_slip_of_its_satellite_and_of_no_other(jump_m):
    the_world = emulated.world(boresight())
    name = emulated.tracked(emulated.run(the_world, 1)[1][0], 1)[0]
    row = int(the_world.row_of[satellites.parse(name)])
    change_ns = the_world.start_ns + 3 * the_world.interval_ns
    _, blocks, _ = emulated.run(
        emulated.under(the_world, sky=Changing(the_world.sky, row, change_ns, jump_m)), 7
    )
    found = steps(blocks)
    assert len(found) >= 20
    for (_, _, sat), (range_m, phase_m, slips) in found.items():
        changed = satellites.name(sat) == name
        assert slips.tolist() == [0, 0, int(changed), 0, 0, 0]
        assert range_m[2] == pytest.approx(changed * jump_m, abs=3e-3)
        assert np.abs(phase_m[slips == 0]).max() < 3e-3
    after = emulated.channels(blocks[3])
    assert (after["phase_cyc"][after["sat"] == satellites.parse(name)] < 1).all()


@pytest.mark.realdata
@pytest.mark.parametrize(("start", "known"), [("2012-10-31T00:29:56", "R08"), ("2012-10-31T00:59:56", "G10")])
def test_the_real_sky_jumps_only_with_a_slip(start, known):
    """Minutes at which many ephemerides change; each has a satellite that jumps by over 0.3 m."""
    sky = {
        "gps": [str(data_file("navigation/brdc3050.12n.gz"))],
        "glonass": [str(data_file("navigation/brdc3050.12g.gz"))],
    }
    the_world = emulated.world(boresight(), sky=sky, time={"start_gps": start, "duration_s": 60})
    order = emulated.sealed(*(emulated.command(r, 5, emulated.TRACK, known) for r in (1, 2, 3, 4)))
    _, blocks, _ = emulated.run(the_world, 9, {1: order})
    found = steps(blocks[1:])
    jumps = {}
    for (_, _, sat), (range_m, phase_m, slips) in found.items():
        jumps[satellites.name(sat)] = range_m[2]
        assert slips.sum() == slips[2] <= 1
        assert (np.abs(range_m[slips == 0]) < JUMP_M).all()
        assert (np.abs(phase_m[slips == 0]) < JUMP_M).all()
    print({name: round(float(jump), 3) for name, jump in sorted(jumps.items())})
    assert abs(jumps[known]) > 0.3
