"""Frames against erfa and published examples."""

from __future__ import annotations

from datetime import datetime

import erfa
import numpy as np
import pytest

from dbc import gpstime
from emulator.world import frames


def test_julian_date_is_erfas():
    t_ns = gpstime.from_utc(datetime(2021, 6, 10, 3, 4, 5))
    expected = erfa.taitt(*erfa.utctai(*erfa.dtf2d("UTC", 2021, 6, 10, 3, 4, 5.0)))
    assert np.sum(frames.tt_jd(t_ns)) == pytest.approx(sum(expected), abs=1e-9)
    assert frames.tt_jd(t_ns)[1] == pytest.approx(sum(expected) - frames.tt_jd(t_ns)[0], abs=1e-9)
