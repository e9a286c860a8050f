"""What the CRC-8 does not see, counted: one to four bits and bursts, every kind of message."""

from __future__ import annotations

from math import comb

import e2e.p11
import numpy as np
import pytest

from gnss_hil.dbc.common.limits import MAX_RECEIVERS
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.e2e import crc, fresh_counters, protect
from gnss_hil.dbc.contract.frames import batch
from gnss_hil.dbc.contract.messages import messages
from gnss_hil.dbc.contract.screening import Verdict, screen
from tests.support import undetected

CODEC = codec(MAX_RECEIVERS)
KINDS = {message.kind.name: message.can_id for message in messages(MAX_RECEIVERS)}
"""An identifier of each kind, the highest."""

PAYLOAD = {1: 0, 2: 0, 3: 198, 4: 2453}
WITH_IDENTIFIER = {1: 0, 2: 0, 3: 296, 4: 4750}

pytestmark = pytest.mark.verifies(
    "dbc/contract/e2e.py",
    what="Corruptions that the CRC-8 does not see",
    by="every pattern of one to four bits, by a register of the test's own; autosar-e2e on samples",
    status="validated",
)


def frame(can_id: int) -> np.ndarray:
    """(8,) a protected frame with random contents."""
    raw = np.random.default_rng(can_id).integers(0, 256, (1, 8), np.uint8)
    sealed, _ = protect(CODEC, batch(can_id, raw), fresh_counters(CODEC), 5)
    return sealed.data[0]


def passes(can_id: int, data: np.ndarray) -> np.ndarray:
    """(n,) whether payloads (n, 8) have the CRC of an identifier."""
    return crc(np.full(len(data), can_id), data) == data[:, 0]


@pytest.mark.parametrize("bits", PAYLOAD)
def test_patterns_without_a_syndrome(bits):
    assert len(undetected.patterns(bits)) == comb(64, bits)
    assert len(undetected.undetected(bits)) == PAYLOAD[bits]


@pytest.mark.parametrize("kind", KINDS)
def test_every_pattern_is_seen_or_not_whatever_the_message(kind):
    """All 679,120 patterns on a frame of each kind, by the CRC of the flight."""
    can_id = KINDS[kind]
    sound = frame(can_id)
    for bits, count in PAYLOAD.items():
        every = undetected.patterns(bits)
        through = passes(can_id, sound ^ undetected.masks(every))
        assert np.array_equal(every[through], undetected.undetected(bits)) and through.sum() == count


@pytest.mark.parametrize("kind", KINDS)
def test_autosars_library_says_the_same(kind):
    """All patterns of three bits that pass, and a sample of the others."""
    can_id, rng = KINDS[kind], np.random.default_rng(7)
    sound = frame(can_id)
    for bits in PAYLOAD:
        every = undetected.patterns(bits)
        some = np.unique(rng.integers(len(every), size=300))
        chosen = np.concatenate([undetected.undetected(bits)[:198], every[some]])
        altered = sound ^ undetected.masks(chosen)
        theirs = [e2e.p11.e2e_p11_check(bytearray(row.tobytes()), can_id) for row in altered]
        assert passes(can_id, altered).tolist() == theirs


@pytest.mark.parametrize("bits", WITH_IDENTIFIER)
def test_with_the_identifiers_bits(bits):
    found = undetected.undetected(bits, 75)
    assert len(undetected.patterns(bits, 75)) == comb(75, bits) and len(found) == WITH_IDENTIFIER[bits]
    sound, can_id = frame(0x105), 0x105
    for pattern in found[:400]:
        ours = pattern[pattern < 64]
        data = sound ^ undetected.masks(ours[None])[0] if len(ours) else sound
        other = can_id ^ int(sum(1 << int(bit) - 64 for bit in pattern[pattern >= 64]))
        assert passes(other, data[None]).all()
        assert e2e.p11.e2e_p11_check(bytearray(data.tobytes()), other)


@pytest.mark.parametrize(
    ("length", "through", "of"),
    [(1, 0, 64), (2, 0, 63), (3, 0, 124), (4, 0, 244), (5, 0, 480), (6, 0, 944), (7, 0, 1856), (8, 5, 3648)],
)
def test_bursts(length, through, of):
    masks = undetected.wire_bursts(length)
    assert len(np.unique(masks, axis=0)) == len(masks)
    assert len(masks) == of
    for can_id in KINDS.values():
        assert passes(can_id, frame(can_id) ^ masks).sum() == through


@pytest.mark.parametrize(("bits", "left"), [(3, 87), (4, 719)])
def test_those_behind_the_header_pass_every_check_of_the_frame(bits, left):
    found = undetected.behind_the_header(undetected.undetected(bits))
    can_id = CODEC.can_id_of["SV_X", 1]
    every = undetected.patterns(bits, 48) + np.uint8(16)
    through = passes(can_id, frame(can_id) ^ undetected.masks(every))
    assert np.array_equal(every[through], found) and len(found) == left
    altered = frame(can_id) ^ undetected.masks(found)
    for row in altered[:: max(1, len(altered) // 200)]:
        verdict = screen(CODEC, batch(can_id, row[None]), fresh_counters(CODEC)).verdict
        assert verdict.tolist() == [Verdict.OK]


def test_blocks_for_a_sweep_differ_from_the_sound_one_in_one_frame():
    ids = [CODEC.can_id_of["RANGE", 1], CODEC.can_id_of["SV_X", 1]]
    block, _ = protect(CODEC, batch(ids, np.zeros((2, 8), np.uint8)), fresh_counters(CODEC), 0)
    swept = list(undetected.corrupted(block, 1))
    assert len({other.data.tobytes() for other in swept}) == len(swept) == 87 + 719
    for other in swept[::100]:
        assert np.array_equal(other.data[0], block.data[0]) and passes(ids[1], other.data[1:]).all()
        assert 3 <= np.bitwise_count(other.data[1] ^ block.data[1]).sum() <= 4
