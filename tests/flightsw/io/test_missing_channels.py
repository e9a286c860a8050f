"""A STATUS that counts what did not come is told in its epoch, and one that is explained is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gnss_hil.dbc.common.protection import Protection
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.e2e_state import limits
from gnss_hil.dbc.contract.frames import RTR_FLAG, concat
from gnss_hil.dbc.contract.messages import MEASUREMENT_KINDS
from gnss_hil.dbc.contract.screening import Verdict
from gnss_hil.flightsw.io.decode import decode
from gnss_hil.flightsw.io.frame_statistics import Reason, no_rejections
from gnss_hil.flightsw.io.reception import nothing_received
from tests.support import synthetic_epochs as s
from tests.support.fixes import craft
from tests.support.flown import CODEC, FakeBus

pytestmark = pytest.mark.verifies(
    "flightsw/io/missing_channels.py",
    what="Channels that are lost whole: told by the STATUS that counts them",
    by="rules of docs/contract.md; any loss and damage that hypothesis finds, put into sound blocks",
    status="validated",
)

USUAL = limits(Protection())
WARY = limits(
    Protection(
        window_size=6, min_ok_state_valid=3, min_ok_state_init=3, min_ok_state_invalid=4,
        max_error_state_valid=2, max_error_state_init=2, max_error_state_invalid=1, use_state_init=False,
    )
)  # fmt: skip
RX = 2
CHANNELS = 6
STATUS = CODEC.can_id_of["STATUS", RX]


@pytest.fixture(scope="module")
def blocks():
    """Consecutive blocks of four receivers with six channels each."""
    bus = FakeBus(craft(), s.constellation())
    return [bus.block(k) for k in range(4)]


def of_receiver(block, channels=range(CHANNELS), kinds=MEASUREMENT_KINDS):
    """(n,) measurement frames of RX."""
    kind = np.isin(block.can_id, [CODEC.can_id_of[name, RX] for name in kinds])
    return kind & np.isin(block.data[:, 2] & 31, channels)


def told(*blocks, usual=USUAL):
    """Of the last block: how often INCOMPLETE was told of each identifier, and all counts by reason."""
    received, rejected = nothing_received(CODEC), no_rejections()
    for block in blocks:
        before = rejected
        _, received, rejected = decode(CODEC, usual, block, received, rejected)
    counts = rejected - before
    incomplete = counts[Reason.INCOMPLETE]
    by_reason = {reason: int(n) for reason, n in enumerate(counts.sum(axis=1)) if n}
    return {int(i): int(incomplete[i]) for i in incomplete.nonzero()[0]}, by_reason


def damaged(block, which):
    data = block.data.copy()
    data[which, 5] ^= 0x40
    return replace(block, data=data)


def saying(block, kind, name, value):
    """With another value of one signal in the receiver's frame of a kind, validly protected."""
    (row,) = np.flatnonzero(block.can_id == CODEC.can_id_of[kind, RX])
    layout, data = CODEC.kinds[kind], block.data.copy()
    i = layout.signals.index(name)
    words = data.view("<u8")[:, 0]
    words[row] &= ~(layout.mask[i] << layout.shift[i])
    words[row] |= np.uint64(value) << layout.shift[i]
    data[row, 0] = e2e.crc(block.can_id[row : row + 1], data[row : row + 1])[0]
    return replace(block, data=data)


@pytest.mark.parametrize("lost", [[0], [5], [1, 2, 3], list(range(CHANNELS))])
def test_channels_that_are_lost_whole_are_told_at_the_status_and_nowhere_else(blocks, lost):
    block = blocks[1]
    assert told(*blocks[:2]) == ({}, {})
    found, reasons = told(blocks[0], block[~of_receiver(block, lost)])
    assert found == {STATUS: 1} and reasons == {Reason.INCOMPLETE: 1}


@pytest.mark.parametrize("kind", MEASUREMENT_KINDS)
def test_channels_that_are_there_in_part_tell_it_themselves(blocks, kind):
    block = blocks[0]
    found, _ = told(block[~of_receiver(block, kinds=[kind])])
    assert STATUS not in found and sum(found.values()) == 9 * CHANNELS
    found, _ = told(block[~(of_receiver(block) & ~of_receiver(block, kinds=[kind]))])
    assert found == {CODEC.can_id_of[kind, RX]: CHANNELS}, "one frame of each is there"


def test_what_was_refused_has_come(blocks):
    """Corrupted, of another form, of another epoch, out of sequence: each has its own reason."""
    first, second = blocks[:2]
    here = of_receiver(second)
    assert told(first, damaged(second, here)) == ({}, {Verdict.CORRUPTED: 60})
    short = replace(second, length=np.where(here, 7, second.length).astype(np.uint8))
    assert told(first, short) == ({}, {Verdict.WRONG_LENGTH: 60})
    remote = replace(second, can_id=np.where(here, second.can_id | RTR_FLAG, second.can_id).astype(np.uint32))
    assert told(first, remote) == ({}, {Verdict.REMOTE: 60})
    late = concat([second[~here], first[of_receiver(first)]])
    assert told(first, late) == ({}, {Verdict.MIXED_EPOCH: 60})
    data = second.data.copy()
    data[here, 1] += 7
    data[here, 0] = e2e.crc(second.can_id[here], data[here])
    assert told(first, replace(second, data=data)) == ({}, {Verdict.WRONG_SEQUENCE: 60})


def test_frames_of_streams_that_are_not_valid_have_come():
    """Three bad epochs of four, and the next sound one is not used either."""
    bus = FakeBus(craft(), s.constellation())
    longer = [bus.block(k) for k in range(11)]
    lost = [damaged(block, of_receiver(block)) if k in (6, 7, 9) else block for k, block in enumerate(longer)]
    found, reasons = told(*lost, usual=WARY)
    assert found == {} and reasons == {Verdict.LOST: 60, Reason.STREAM_NOT_VALID: 60}


def test_what_comes_again_has_come_once(blocks):
    block = blocks[0]
    one, others = of_receiver(block, [0]), of_receiver(block, range(1, CHANNELS))
    found, reasons = told(concat([block[~one], block[others]]))
    assert found == {STATUS: 1} and reasons == {Reason.INCOMPLETE: 1, Verdict.REPEATED: 50}


def test_a_damaged_frame_may_be_of_a_channel_that_is_not_there_otherwise(blocks):
    block = blocks[0]
    only = of_receiver(block, [0]) & ~of_receiver(block, kinds=["RANGE"])
    assert told(damaged(block[~only], of_receiver(block[~only], [0])))[0] == {}
    lost = block[~of_receiver(block, [0, 1])]
    found, _ = told(damaged(lost, of_receiver(lost, [2], ["RANGE"])))
    assert found.pop(STATUS) == 1 and sum(found.values()) == 9, "one may be, two are not"


@pytest.mark.parametrize(
    ("frames", "is_told"),
    [(0, False), (1, False), (60, False), (61, False), (62, False), (64, False), (70, False), (71, True),
     (1023, True)],
)  # fmt: skip
def test_a_receiver_that_counts_too_little_or_what_is_no_measurement_is_not_told(blocks, frames, is_told):
    found, _ = told(saying(blocks[0], "STATUS", "frames", frames))
    assert found == ({STATUS: 1} if is_told else {})


@pytest.mark.parametrize("kind", ["STATUS", "TAG", "HEARTBEAT"])
def test_what_closes_an_epoch_is_incomplete_without_the_others_as_before(blocks, kind):
    """A STATUS that is missing counts nothing; one that is incomplete is told once, whatever it counts."""
    block = blocks[0]
    block = block[~of_receiver(block) & (block.can_id != CODEC.can_id_of[kind, RX])]
    left = {"STATUS", "TAG", "HEARTBEAT"} - {kind}
    assert told(block)[0] == {CODEC.can_id_of[name, RX]: 1 for name in left}


def test_a_status_of_another_epoch_counts_nothing(blocks):
    first, second = blocks[:2]
    lost = second[~of_receiver(second) & (second.can_id != STATUS)]
    found, _ = told(first, concat([lost, first[first.can_id == STATUS]]))
    assert STATUS not in found


@settings(max_examples=200)
@given(
    lost=st.sets(st.tuples(st.integers(0, CHANNELS - 1), st.sampled_from(MEASUREMENT_KINDS))),
    whole=st.sets(st.integers(0, CHANNELS - 1)),
)
def test_told_is_what_is_lost_whole_and_nothing_else(blocks, lost, whole):
    lost = lost | {(channel, kind) for channel in whole for kind in MEASUREMENT_KINDS}
    block = blocks[0]
    gone = np.zeros(len(block), bool)
    for channel, kind in lost:
        gone |= of_receiver(block, [channel], [kind])
    found, _ = told(block[~gone])
    none_left = any(sum(k == channel for k, _ in lost) == 10 for channel in range(CHANNELS))
    assert (STATUS in found) == none_left
