"""A flight that several tests look at."""

from __future__ import annotations

import pytest

from gnss_hil.flightsw.app.config import configure
from tests.support.flights import SKY, SOYUZ, fly, soyuz
from tests.support.flown import FakeBus


@pytest.fixture(scope="module")
def flight():
    """Twelve epochs of the patent's policy from a cold start."""
    bus = FakeBus(soyuz(), SKY)
    config = configure(SOYUZ, "patent", {})
    return bus, config, *fly(bus, config, 12)
