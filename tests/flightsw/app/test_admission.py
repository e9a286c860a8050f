"""What of a block of frames is used, flown on a fake bus."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.dbc.common.protection import Protection
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.frames import concat
from gnss_hil.flightsw.app.config import configure
from gnss_hil.flightsw.app.step import flight_step
from gnss_hil.flightsw.io.frame_statistics import Reason
from tests.support import synthetic_epochs as s
from tests.support.flights import SKY, SOYUZ, fly, soyuz, used
from tests.support.flown import CODEC, FakeBus, mark_frames

pytestmark = pytest.mark.verifies(
    "flightsw/app/admission.py",
    what="What an epoch goes on with",
    by="rules of ours, flown epoch by epoch: other sessions, damaged frames, channels that promise nothing",
    status="modelled",
)


def test_new_session_starts_fresh(flight):
    _, config, states, *_ = flight
    bus = FakeBus(soyuz(), SKY, session=8)
    again, answers, _ = fly(bus, config, 1, states[-1])
    _, expected, _ = fly(FakeBus(soyuz(), SKY, session=8), config, 1)
    assert answers == expected and again[0].mark.session == 8


def test_limits_of_the_vehicle_file_are_flown():
    """By AUTOSAR's letter a stream is used when it is valid, here after three sound epochs: the mark too."""
    wary = replace(SOYUZ, protection=Protection(min_ok_state_init=2, min_ok_state_invalid=2,
                   max_error_state_init=8, max_error_state_invalid=8, use_state_init=False))  # fmt: skip
    states, _, blocks = fly(FakeBus(soyuz(), SKY), configure(wary, "patent", {}), 4)
    assert [state.solution.fix is not None for state in states] == [False, False, True, True]
    assert states[-1].rejected[Reason.STREAM_NOT_VALID].sum() >= len(blocks[0])
    again, *_ = fly(FakeBus(soyuz(), SKY, session=8), configure(wary, "patent", {}), 4, states[-1])
    assert [state.solution.fix is not None for state in again] == [False, False, True, True]


def test_new_session_keeps_what_was_counted(flight):
    _, config, states, _, blocks = flight
    noisy, _ = flight_step(config, states[-1], concat([blocks[-1][:40], blocks[-1][:40]]))
    counted = noisy.rejected.copy()
    assert counted.sum() > 40
    again, _ = flight_step(config, replace(noisy, lost=3), FakeBus(soyuz(), SKY, session=8).block(0))
    assert np.array_equal(again.rejected, counted) and again.lost == 3 and again.mark.session == 8


@pytest.mark.parametrize("epoch", [11, 27, 40], ids=["this epoch's nibble", "likewise", "another"])
@pytest.mark.parametrize("counter", range(15))
@pytest.mark.parametrize("place", [0, 1, 3, -1])
def test_stray_time_mark_of_another_session_costs_nothing(flight, place, counter, epoch):
    _, config, states, answers, blocks = flight
    stray, _ = e2e.protect(CODEC, mark_frames(epoch, s.T0_NS, session=8)[0], e2e.fresh_counters(CODEC), epoch)
    stray.data[0, 1] = stray.data[0, 1] & 0xF0 | counter
    stray.data[0, 0] = e2e.crc(stray.can_id, stray.data)[0]
    block = blocks[-1]
    place %= len(block)
    state, answer = flight_step(config, states[-2], concat([block[:place], stray, block[place:]]))
    told = answer.can_id == CODEC.can_id_of["NAV_REFUSED", 0]
    assert answer[~told] == answers[-1]
    assert CODEC.decode("NAV_REFUSED", answer[told].data)["reason"].tolist() == [Reason.OTHER_SESSION]
    assert np.array_equal(state.received.counters, states[-1].received.counters)
    assert int(state.rejected.sum() - states[-1].rejected.sum()) == 1


def test_corrupted_channel_is_out_of_the_fix_and_the_others_stay(flight):
    _, config, states, answers, blocks = flight
    receiver, channel = sorted(used(answers[-1]))[3]
    block = blocks[-1]
    row = np.flatnonzero(block.can_id == CODEC.can_id_of["SV_Z", receiver])
    row = row[block.data[row, 2] & 31 == channel][0]
    data = block.data.copy()
    data[row, 6] ^= 1
    state, answer = flight_step(config, states[-2], replace(block, data=data))
    assert used(answer) == used(answers[-1]) - {(receiver, channel)}
    assert state.solution.fix is not None


@pytest.mark.parametrize(("ura", "enters"), [(-16, False), (-15, True), (14, True), (15, False)])
def test_what_promises_no_accuracy_stays_out(flight, ura, enters):
    """15 and -16 are no prediction, use at own risk: IS-GPS-200, 30.3.3.1.1.4."""
    _, config, states, answers, blocks = flight
    epoch = blocks[-1]
    row = np.flatnonzero(epoch.can_id == CODEC.can_id_of["SV_VZ", 1])[0]
    bits = CODEC.kinds["SV_VZ"]
    shift = int(bits.shift[bits.signals.index("ura")])
    data = epoch.data.copy()
    word = int(data[row].view("<u8")[0]) & ~(31 << shift) | (ura & 31) << shift
    data[row] = np.array([word], "<u8").view(np.uint8)
    data[row, 0] = e2e.crc(epoch.can_id[row : row + 1], data[row : row + 1])[0]
    _, answer = flight_step(config, states[-2], replace(epoch, data=data))
    left_out = set() if enters else {(1, int(data[row, 2] & 31))}
    assert used(answers[-1]) - used(answer) == left_out


def test_unhealthy_and_unlocked_channels_stay_out(flight):
    _, config, states, answers, _ = flight
    epoch = flight[4][-1]
    row = np.flatnonzero(epoch.can_id == CODEC.can_id_of["SV_Z", 1])[0]
    bits = CODEC.kinds["SV_Z"]
    data = epoch.data.copy()
    word = int(data[row].view("<u8")[0]) | 1 << int(bits.shift[bits.signals.index("health")])
    data[row] = np.array([word], "<u8").view(np.uint8)
    data[row, 0] = e2e.crc(epoch.can_id[row : row + 1], data[row : row + 1])[0]
    state, answer = flight_step(config, states[-2], replace(epoch, data=data))
    assert used(answers[-1]) - used(answer) == {(1, int(data[row, 2] & 31))}
    permitted, before = (one.channels.satellites.permitted for one in (state, states[-1]))
    (unhealthy,) = np.flatnonzero(~state.predictions.healthy & states[-1].predictions.healthy)
    assert before[unhealthy] >= 0 and permitted[unhealthy] < 0
