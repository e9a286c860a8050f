"""What cannot be asked of a receiver that is real."""

from datetime import datetime
from types import SimpleNamespace

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites, vehicle
from gnss_hil.emulator.assemble.recorded import (
    _commonest_step_ns,
    _epoch_of,
    _frequencies,
    _refuse,
)
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.config.scenario import ScenarioError
from gnss_hil.emulator.config.tables import Time
from gnss_hil.emulator.receivers.recorded.signals import SIGNALS
from tests.support import emulated

PLAYED = {"name": "grace", "vehicle": "observed.toml", "observations": {"file": "x.rnx"}}
ONE = vehicle.load(vehicle.find("observed"))


@pytest.mark.parametrize(
    ("sky", "craft", "key"),
    [
        ({"ionosphere": True}, {}, r"sky\.factors\.ionosphere"),
        ({"code_bias": True}, {}, r"sky\.factors\.code_bias"),
        ({}, {"factors": {"multipath": True}}, r"craft\.grace\.factors\.multipath"),
        ({}, {"structure": "iss"}, r"craft\.grace\.structure"),
    ],
)
def test_errors_of_emulated_receivers_are_refused(sky, craft, key):
    with pytest.raises(ScenarioError, match=f"^{key}: acts on emulated receivers"):
        _refuse(scenario.Sky(factors=sky), scenario.Craft(**PLAYED, **craft), ONE)


def test_errors_of_what_satellites_report_are_not():
    _refuse(scenario.Sky(factors={"ephemeris_error": True}), scenario.Craft(**PLAYED), ONE)


SKY = emulated.world().sky
MARKS_NS = np.array((1_035_676_816, 1_035_680_000)) * 10**9
GLONASS = satellites.index(satellites.GLONASS, np.array((1, 2, 3)))


def observed(sat, frequencies):
    return SimpleNamespace(sat=sat, origin="x.obs", header=SimpleNamespace(frequencies=frequencies))


def test_frequencies_are_those_of_the_messages_where_the_file_has_none():
    """Version 2 has no header line for them; what the header has counts."""
    broadcast = SKY.at(int(MARKS_NS[0])).broadcast
    told = dict(zip(satellites.number_of(SKY.index).tolist(), broadcast.frequency.tolist(), strict=True))
    signals = [SIGNALS["L1CA"], SIGNALS["L1OF"]]
    found = _frequencies(observed(GLONASS, {2: -7}), SKY, MARKS_NS, signals)
    assert found[2] == -7
    for number in (1, 3, 24):
        assert found[number] == told[number]


def test_a_frequency_that_nobody_knows_is_a_fault_only_of_satellites_above():
    silent = SimpleNamespace(index=GLONASS[:2], messages=np.zeros(2, bool))
    words = r"x\.obs: neither GLONASS SLOT / FRQ # nor navigation messages \(--nav FILE\) have .* of R02"
    with pytest.raises(ScenarioError, match=words):
        _frequencies(observed(GLONASS, {1: 1}), silent, MARKS_NS, [SIGNALS["L1OF"]])
    assert _frequencies(observed(GLONASS, {1: 1, 2: 0}), silent, MARKS_NS, [SIGNALS["L1OF"]]) == {1: 1, 2: 0}
    assert not _frequencies(observed(GLONASS, {}), silent, MARKS_NS, [SIGNALS["L1CA"]])


def test_an_odd_epoch_changes_no_interval_and_is_left_out():
    start = datetime(2012, 10, 31)
    time = Time(start_gps=start, duration_s=100, epoch_interval_s=10)
    t_s = np.array((0, 10, 12.5, 20, 30, 30.5, 40, 50))
    file = SimpleNamespace(t_ns=time.start_ns + (t_s * 1e9).astype(np.int64))
    assert _commonest_step_ns(file.t_ns) == 10 * 10**9
    assert _epoch_of(file, time, "x").tolist() == [0, 1, -1, 2, 3, -1, 4, 5]
    with pytest.raises(ScenarioError, match="x has an epoch every 10 s; epoch_interval_s is 5"):
        _epoch_of(file, time.model_copy(update={"epoch_interval_s": 5.0}), "x")
