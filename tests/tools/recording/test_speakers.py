"""Who spoke for which node."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.frames import FrameBatch, batch, concat
from gnss_hil.dbc.lockstep import messages
from gnss_hil.tools.recording.speakers import Speakers
from tests.support.lockstep_frames import CODEC, SESSION, heartbeat, mark

pytestmark = pytest.mark.verifies(what="Record: whether it is the flight")


def said(kind: str, epoch: int, number: int = 0) -> FrameBatch:
    frame = batch([CODEC.can_id_of[kind, number]], np.zeros((1, 8), np.uint8))
    return e2e.protect(CODEC, frame, e2e.fresh_counters(CODEC), epoch)[0]


def speakers(*pieces: tuple[int, FrameBatch]) -> Speakers:
    found = Speakers(CODEC)
    for peer, frames in pieces:
        found.hear(peer, frames, SESSION)
    return found


EMULATOR = concat((mark(5), said("RANGE", 5, 1), messages.encode(messages.SYNC_ID, SESSION, 5, 2)))
FLIGHT = concat((said("NAV_STATUS", 5), said("NAV_X", 5), messages.encode(messages.DONE_ID, SESSION, 5, 2)))


def test_each_node_has_one_speaker():
    found = speakers((1, EMULATOR), (2, FLIGHT), (1, EMULATOR), (2, FLIGHT))
    assert (found.several, found.contested) == ((), ())


@pytest.mark.parametrize("frame", [said("NAV_X", 5), messages.encode(messages.DONE_ID, SESSION, 5, 2)])
def test_who_speaks_by_turns_contests_a_node(frame):
    found = speakers((1, EMULATOR), (2, FLIGHT), (3, frame), (2, FLIGHT))
    assert found.several == found.contested == ("FLIGHT",)


def test_one_after_the_other_is_a_restart():
    found = speakers((1, EMULATOR), (2, FLIGHT), (3, FLIGHT), (3, FLIGHT))
    assert (found.several, found.contested) == (("FLIGHT",), ())


def damaged(frames: FrameBatch) -> FrameBatch:
    return FrameBatch(frames.t_ns, frames.can_id, frames.length, frames.data | np.uint8([0] * 7 + [1]))


@pytest.mark.parametrize(
    "frame",
    [
        damaged(said("NAV_X", 5)),
        said("NAV_X", 7),
        said("NAV_X", 12),
        messages.encode(messages.DONE_ID, SESSION, 2**32 - 1, 2),
        batch(0x7E0, bytes(8)),
        batch(messages.DONE_ID, b""),
        messages.encode(messages.END_ID, SESSION + 1, 5, 0),
    ],
    ids=["CRC", "after the next", "nine epochs ago", "bench epoch", "UDS", "short", "session"],
)
def test_what_nobody_believes_speaks_for_no_node(frame):
    found = speakers((1, EMULATOR), (2, FLIGHT), (3, frame), (2, FLIGHT))
    assert (found.several, found.contested) == ((), ())


def test_a_heartbeat_contests_nothing():
    flight = said("NAV_X", 0)
    found = speakers((1, mark(0)), (2, flight), (3, heartbeat()), (2, flight))
    assert (found.several, found.contested) == (("FLIGHT",), ())
