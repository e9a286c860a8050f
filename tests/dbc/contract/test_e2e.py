"""Protection as it is sent: AUTOSAR's published example, an independent implementation, and counters."""

from __future__ import annotations

import e2e.p11
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss_hil.dbc.contract.e2e import COUNTERS, crc, fresh_counters, protect
from gnss_hil.dbc.contract.frames import batch, concat
from tests.support.streams import CODEC, RANGE, stream


@pytest.mark.parametrize(("counter", "expected"), [(0, 0xCC), (1, 0x91)])
def test_published_example(counter, expected):
    """AUTOSAR PRS E2E Protocol, Profile 11 variant A, data id 0x123, eight zero bytes."""
    data = np.zeros((1, 8), np.uint8)
    data[0, 1] = counter
    assert crc(np.array([0x123]), data)[0] == expected


@pytest.mark.verifies(
    "dbc/contract/e2e.py",
    what="End-to-end protection",
    by="AUTOSAR PRS example (0xCC, 0x91); the library autosar-e2e",
    status="validated",
)
@given(payload=st.binary(min_size=8, max_size=8), data_id=st.integers(0, 2047))
def test_agrees_with_autosar_e2e(payload, data_id):
    theirs = bytearray(payload)
    e2e.p11.e2e_p11_protect(theirs, data_id, increment_counter=False)
    assert crc(np.array([data_id]), np.frombuffer(payload, np.uint8)[None])[0] == theirs[0]


def test_counter_runs_0_to_14_in_each_stream_apart():
    frames, counters = stream(3, 17)
    assert (frames.data[:, 1] & 15).tolist() == [k % COUNTERS for k in range(17)]
    other, _ = stream(4, 1, counters)
    assert other.data[0, 1] & 15 == 0
    more, _ = stream(3, 1, counters)
    assert more.data[0, 1] & 15 == 2


def test_epoch_nibble_is_the_epoch_modulo_16():
    frames, _ = stream(0, 1, epoch=37)
    assert frames.data[0, 1] >> 4 == 5


def test_what_is_not_in_the_contract_passes_unsealed():
    good, _ = stream(0, 1)
    stranger = batch(0x555, bytes(8))
    raw = batch(RANGE, CODEC.encode("RANGE", {"channel": 0, "pseudorange_m": 2.1e7}))
    sealed, _ = protect(CODEC, concat([raw, stranger]), fresh_counters(CODEC), 0)
    assert sealed[0] == good
    assert sealed[1:] == stranger
