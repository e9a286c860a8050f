"""The process around the flight software: what it tells people."""

from __future__ import annotations

from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.screening import Verdict
from gnss_hil.flightsw.__main__ import _report_rejections
from gnss_hil.flightsw.io.frame_statistics import Reason, no_rejections


def test_what_was_refused_is_told_with_place_and_consequence(capsys):
    rejected = no_rejections()
    rejected[Verdict.CORRUPTED, 0x100] = 3
    rejected[Reason.TIMED_OUT, 0x709] = 2
    _report_rejections(codec(4), rejected)
    first, second = capsys.readouterr().err.splitlines()
    assert first == "flightsw: 3 x CORRUPTED at 0x100 RX1: frame ignored, its channel is out of this epoch"
    assert second.startswith("flightsw: 2 x TIMED_OUT at 0x709 ATT: ")
