"""Batches and their wire form."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.contract.frames import EMPTY, RTR_FLAG, batch, concat, from_wire, to_wire


def test_wire_is_struct_can_frame():
    """<linux/can.h>: __u32 can_id; __u8 len; 3 bytes; __u8 data[8]."""
    frames = concat([batch(0x123, b"\x01\x02\x03"), batch(0x7FF | RTR_FLAG, b"", length=0)])
    assert to_wire(frames) == (
        struct.pack("<IB3x8s", 0x123, 3, b"\x01\x02\x03") + struct.pack("<IB3x8s", 0x7FF | RTR_FLAG, 0, b"")
    )
    assert from_wire(to_wire(frames)) == frames


def test_rows_are_batches():
    frames = batch([1, 2, 3], np.arange(24).reshape(3, 8))
    assert frames[1].can_id.tolist() == [2]
    assert frames[-1].can_id.tolist() == [3]
    assert frames[frames.can_id > 1].can_id.tolist() == [2, 3]
    assert concat([frames[:1], EMPTY, frames[1:]]) == frames
    assert concat([]) == EMPTY


def test_batches_one_after_another_are_rows_of_one():
    first, second = (batch([k], bytes([k] * k), t_ns=10 * k) for k in (3, 5))
    both = concat((first, second))
    assert (both.t_ns.tolist(), both.can_id.tolist(), both.length.tolist()) == ([30, 50], [3, 5], [3, 5])
    assert both[0] == first and both[1] == second


@pytest.mark.parametrize(("name", "system", "number"), [("G07", 0, 7), ("R24", 1, 24), ("E63", 2, 63)])
def test_satellite_names(name, system, number):
    index = satellites.parse(name)
    assert (satellites.system_of(index), satellites.number_of(index)) == (system, number)
    assert satellites.name(index) == name


def test_every_index_has_a_name_of_its_own():
    """Three bits of system and six of number pass the contract, named by RINEX or not."""
    names = [satellites.name(i) for i in range(satellites.SATELLITES)]
    assert len(set(names)) == satellites.SATELLITES
    assert names[satellites.index(7, 63)] == "7:63"
    assert names[satellites.index(7, 0)] == "7:00"


@pytest.mark.parametrize("text", ["", "G7", "X01", "G00", "G64", "g01", "7:63"])
def test_no_satellite_names(text):
    with pytest.raises(ValueError, match="not a satellite name"):
        satellites.parse(text)
