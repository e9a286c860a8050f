"""Signals of single frames, against cantools."""

from __future__ import annotations

import cantools
import pytest

from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch, concat
from gnss_hil.tools.gateway.one_frame import Reader
from tests.support.lockstep_frames import CODEC, mark

READER = Reader(CODEC, "TIME_MARK", "session", "epoch")
DATABASE = cantools.database.load_string(CODEC.text, "dbc")

pytestmark = pytest.mark.verifies(
    "tools/gateway/one_frame.py",
    what="Signals of single frames",
    by="cantools; frames with a wrong CRC, cut ones",
    status="validated",
)


def test_signals_are_those_of_cantools():
    one = mark(5)
    said = DATABASE.decode_message(int(one.can_id[0]), one.data[0].tobytes(), decode_choices=False)
    assert READER.first(one) == [said["session"], said["epoch"]]
    assert READER.rows(concat((one, one))) == [0, 1]


def test_of_a_frame_that_is_not_whole_nothing_is_read():
    one = mark(5)
    wrong = one.data.copy()
    wrong[0, 5] ^= 1
    assert READER.first(FrameBatch(one.t_ns, one.can_id, one.length, wrong)) is None
    assert READER.first(FrameBatch(one.t_ns, one.can_id, one.length - 1, one.data)) is None
    assert READER.first(EMPTY) is None
