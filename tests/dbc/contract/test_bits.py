"""Frame lengths against a bit-by-bit transmitter written from ISO 11898-1."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss_hil.dbc.contract.bits import frame_bits
from gnss_hil.dbc.contract.frames import batch

pytestmark = pytest.mark.verifies(
    "dbc/contract/bits.py",
    what="Frame lengths with stuffing",
    by="bit-by-bit transmitter from ISO 11898-1; Tindell's bounds 111 to 135",
    status="validated",
)


def transmitted_bits(can_id: int, payload: bytes) -> int:
    def msb_first(value, width):
        return [value >> k & 1 for k in reversed(range(width))]

    bits = [0, *msb_first(can_id, 11), 0, 0, 0, *msb_first(len(payload), 4)]
    for byte in payload:
        bits += msb_first(byte, 8)
    crc = 0
    for bit in bits:
        crc = (crc << 1 & 0x7FFF) ^ (0x4599 if bit ^ crc >> 14 else 0)
    bits += msb_first(crc, 15)
    sent, last, run = 0, None, 0
    for bit in bits:
        sent += 1
        run = run + 1 if bit == last else 1
        last = bit
        if run == 5:
            sent, last, run = sent + 1, 1 - bit, 1
    return sent + 1 + 2 + 7 + 3


runs = st.sampled_from([0x00, 0xFF, 0xF8, 0x1F, 0x07, 0x83])
payloads = st.lists(st.one_of(runs, st.integers(0, 255)), max_size=8).map(bytes)


@given(can_id=st.integers(0, 0x7FF), payload=payloads)
def test_equal_to_a_bit_by_bit_transmitter(can_id, payload):
    assert frame_bits(batch(can_id, payload))[0] == transmitted_bits(can_id, payload)


def test_within_the_published_bounds():
    """K. Tindell et al. 1995: an 8-byte base frame takes 111 to 135 bits with 3 bits of intermission."""
    rng = np.random.default_rng(3)
    data = rng.choice(np.array([0, 255, 0xF8, 0x3C, 7], np.uint8), (20_000, 8))
    bits = frame_bits(batch(rng.integers(0, 2048, 20_000), data))
    assert bits.min() >= 111
    assert bits.max() <= 135
