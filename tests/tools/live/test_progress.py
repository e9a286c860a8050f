"""Progress: a line on a terminal, lines in a pipe."""

from __future__ import annotations

import io

from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import EMPTY, batch
from gnss_hil.tools.common.durations import clock
from gnss_hil.tools.live.progress import Progress
from gnss_hil.tools.run_config.plan import make

CODEC = codec(4)


def test_progress_is_one_line_on_a_terminal_and_plain_in_a_pipe():
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    said = CODEC.encode("NAV_STATUS", {"mode": 2, "satellites": 24, "pdop": 0.81})
    frames, _ = e2e.protect(
        CODEC, batch(CODEC.can_id_of["NAV_STATUS", 0], said), e2e.fresh_counters(CODEC), epoch=59
    )
    for stream, returns in ((Terminal(), 1), (io.StringIO(), 0)):
        Progress(make("soyuz"), stream)._show(59, frames)
        assert stream.getvalue().count("\r") == returns
        assert "00:01:00 of 00:10:00   10 %" in stream.getvalue()
        assert "24 satellites  PDOP 0.81" in stream.getvalue()
    assert clock(90061) == "1 d 01:01:01"


def test_the_last_line_of_progress_in_a_pipe_is_the_end():
    for shown, lines in ((False, 0), (True, 2)):
        stream = io.StringIO()
        progress = Progress(make("soyuz"), stream)
        if shown:
            progress._show(509, EMPTY)
        progress.hear(0, 599, EMPTY)
        progress.close()
        progress.close()
        said = stream.getvalue().splitlines()
        assert len(said) == lines, "a run too short for a line of progress has none"
        assert not lines or "00:10:00 of 00:10:00  100 %" in said[-1]
