"""Stamps of the record: the epoch's mark, then bit by bit."""

from __future__ import annotations

import io
from datetime import datetime

import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.contract.bits import frame_bits
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import batch, concat
from gnss_hil.tools.recording.formats.candump import parse_lines
from gnss_hil.tools.recording.recorder import Recorder, stamps_us

pytestmark = pytest.mark.verifies(what="Record: canonical order and stamps of frames")

CODEC = codec(4)
START_NS = gpstime.from_utc(datetime(2012, 10, 31, 0, 14, 44))


def test_stamps_restart_at_each_mark():
    got = stamps_us(np.array([1000, 5000]), np.array([3, 2]), np.array([111, 120, 130, 115, 115]))
    assert got.tolist() == [1000, 1111, 1231, 5000, 5115]


def test_an_epoch_without_frames_moves_nobody():
    got = stamps_us(np.array([10, 20, 30]), np.array([1, 0, 1]), np.array([111, 112]))
    assert got.tolist() == [10, 30]


def test_the_log_has_unix_time_of_the_mark_and_exact_bits():
    log, heard = io.BytesIO(), []

    def hear(bus, frames, bits):
        assert bus == 0 and (bits == frame_bits(frames)).all()
        heard.append(frames)

    recorder = Recorder({"can0": CODEC}, START_NS, 10**9, log, hear)
    blocks = [batch([0x10, 0x11], np.arange(16).reshape(2, 8) + i) for i in range(3)]
    for epoch, block in enumerate(blocks):
        recorder.add(0, epoch, block)
    recorder.flush()
    unix_us, _, frames, _ = parse_lines(log.getvalue())
    assert frames == concat(blocks) == concat(heard)
    assert recorder.frames == 6
    assert unix_us[::2].tolist() == [1_351_642_484_000_000 + i * 1_000_000 for i in range(3)]
    assert (unix_us[1::2] - unix_us[::2] == frame_bits(frames[np.array([0, 2, 4])])).all()


def test_nothing_waits_longer_than_a_batch():
    log = io.BytesIO()
    recorder = Recorder({"can0": CODEC}, START_NS, 10**9, log)
    recorder.add(0, 0, batch(np.zeros(20_000, np.uint32), np.zeros((20_000, 8))))
    assert log.getvalue().count(b"\n") == 20_000


@pytest.mark.parametrize("batch_frames", [1, 3, 10**6])
def test_several_buses_are_written_epoch_by_epoch(batch_frames, monkeypatch):
    monkeypatch.setattr("gnss_hil.tools.recording.recorder.BATCH_FRAMES", batch_frames)
    log = io.BytesIO()
    recorder = Recorder({"can0": CODEC, "can1": CODEC}, START_NS, 10**9, log)
    for bus, epoch in ((0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (1, 2)):
        recorder.add(bus, epoch, batch([0x10 + epoch], b"12345678"))
    recorder.flush()
    _, names, frames, _ = parse_lines(log.getvalue())
    assert names.tolist() == [b"can0", b"can1"] * 3
    assert frames.can_id.tolist() == [0x10, 0x10, 0x11, 0x11, 0x12, 0x12]
