"""What is told of a receiver that is played: made-up files and skies."""

from types import SimpleNamespace

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites
from gnss_hil.emulator.assemble.recorded_remarks import lacking_delays, left_out, unknown, unused
from gnss_hil.emulator.receivers.recorded.inter_signal import unknown as unknown_isc
from gnss_hil.emulator.receivers.recorded.signals import SIGNALS

pytestmark = pytest.mark.verifies(
    "emulator/assemble/recorded_remarks.py",
    what="What is told of a receiver that is played",
    by="made-up files and skies; the words are ours",
    status="modelled",
)

GLONASS = satellites.index(satellites.GLONASS, np.array((1, 2, 3)))
GPS = satellites.index(satellites.GPS, np.array((1, 2, 3)))


class Played:
    """What `left_out` asks of tracks."""

    dropped = 0

    def __init__(self, doubtful=2):
        self.doubtful = doubtful

    def __len__(self):
        return 9


def test_satellites_that_the_sky_lacks_are_told():
    sat = np.append(GPS, GPS[2])
    assert list(
        unknown(np.concatenate((sat, GLONASS)), [SIGNALS["L1CA"]], SimpleNamespace(index=GPS[:1]))
    ) == ["G02 and G03 were observed, and are left out: the sky's files lack them"]
    assert not list(unknown(sat, [SIGNALS["L1CA"]], SimpleNamespace(index=sat)))


def test_values_and_strengths_that_are_none_are_told():
    file = SimpleNamespace(repeated={"D1C": 12, "C1C": 3})
    found = list(left_out(file, Played()))
    assert found == [
        "values that 3 satellites of an epoch or more share stand for none, and are left out: 3 of C1C, 12 "
        "of D1C",
        "2 of 9 signal strengths are left out: receivers measure more than 0 and no more than 64 dBHz",
    ]
    assert not list(left_out(SimpleNamespace(repeated={}), Played(doubtful=0)))


def test_systems_that_are_not_used_are_named_with_how_many_observations():
    """Of the run's epochs alone: the second is outside."""
    galileo = satellites.parse("E11")
    file = SimpleNamespace(
        sat=np.array((1, galileo, GLONASS[0], galileo)), epoch=np.array((0, 0, 0, 1)),
        passed={"L": np.array((0, 0, 1))},
    )  # fmt: skip
    assert list(unused(file, np.array((0, -1)), [SIGNALS["L1CA"]])) == [
        "E, L: 3 observations are left out: not used by this bench",
        "R: 1 observation is left out: none of their signals is played",
    ]
    only = SimpleNamespace(sat=np.array((1, GLONASS[0])), epoch=np.array((0, 0)), passed={})
    assert not list(unused(only, np.array((0,)), [SIGNALS["L1CA"], SIGNALS["L1OF"]]))


def lacking(names, precise, known, messages=True, isc_m=None):
    """Remarks on the group delay of signals, and on codes, of a sky of both systems."""
    index = np.concatenate((GPS, GLONASS))
    delay_m = np.full(6, 2.0 if known else 0.0)
    broadcast = SimpleNamespace(
        group_delay_m=delay_m * (index < GLONASS[0]), band_delay_m=delay_m * (index >= GLONASS[0])
    )
    sky = SimpleNamespace(
        index=index, messages=np.full(6, messages), at=lambda t_ns: SimpleNamespace(broadcast=broadcast)
    )
    found = list(lacking_delays(names, sky, np.arange(5), precise, unknown_isc() if isc_m is None else isc_m))
    return [line for line in found if "group delay" in line], [line for line in found if "ISC" in line]


@pytest.mark.parametrize(
    ("names", "precise", "messages", "told"),
    [
        (("L1P",), False, True, True), (("L1P", "L2P"), True, False, False),
        (("L1P",), True, True, True), (("L1P",), True, False, True), (("L1P",), False, False, True),
        (("L1P", "L2P"), False, True, False),
        (("L1OF",), True, True, True), (("L1OF",), False, True, False), (("L1OF",), False, False, True),
        (("L1OF", "L2OF"), True, True, False), (("L1OF", "L2OF"), False, True, True),
    ],
)  # fmt: skip
def test_a_group_delay_that_no_file_has_is_told_where_ranges_take_it(names, precise, messages, told):
    """Clocks of two frequencies miss it for one, GLONASS's clocks of L1 for L2; pairs of GPS need none."""
    delays, _ = lacking(names, precise, known=False, messages=messages)
    assert len(delays) == told
    assert not lacking(names, precise, known=True, messages=messages)[0]


def test_the_line_says_what_is_off_and_what_would_help():
    (line,), _ = lacking(("L1OF", "L2OF"), False, known=False)
    assert line == (
        "glonass: messages have no group delay between the carriers (Delta tau, RINEX 3.05 on; --nav FILE): "
        "ranges of L1OF and L2OF are off by some metres"
    )


def test_codes_that_clocks_do_not_belong_to_are_told():
    assert not lacking(("L1P", "L2P"), True, known=True)[1]
    (line,) = lacking(("L1CA", "L2P"), True, known=True)[1]
    assert line.startswith("gps: clocks are those of L1P: how far from it a satellite sends L1CA (ISC)")
    assert "no file says of 3 of 3 satellites" in line
    isc_m = unknown_isc()
    isc_m[SIGNALS["L1CA"].number, GPS] = 0.3
    assert not lacking(("L1CA", "L2P"), True, known=True, isc_m=isc_m)[1]
    isc_m[SIGNALS["L1CA"].number, GPS[1]] = np.nan
    assert "1 of 3" in lacking(("L1CA", "L2P"), True, known=True, isc_m=isc_m)[1][0]
