"""Worlds that cannot be are refused in one line."""

import pytest

from gnss_hil.emulator.config.scenario import ScenarioError
from tests.support import emulated

pytestmark = [
    pytest.mark.verifies(what="Scenario files"),
    pytest.mark.verifies(
        "emulator/orbits/motion.py",
        "emulator/attitude/turning.py",
        "emulator/config/named_files.py",
        what="Motion of a craft, files a scenario names",
        by="choice of the reader",
        status="modelled",
    ),
]


@pytest.mark.parametrize(
    ("tables", "says"),
    [
        (
            {"clock": {"amplitude_ms": 10, "period_s": 60}},
            r"craft\.soyuz\.clock: .*drifts by up to 31\d{4} m/s",
        ),
        (
            {"attitude": {"mode": "slew", "profile": [{"t_s": 0}, {"t_s": 10, "roll_deg": 90}]}},
            r"craft\.soyuz\.attitude\.profile: the turn from 0 s to 10 s reaches 16\.9 deg/s; allowed 6\.9",
        ),
        ({"orbit": {"altitude_km": 415, "eccentricity": 0.1, "inclination_deg": 50}}, "perigee"),
        (
            {"orbit": {"semi_major_axis_km": 60000, "eccentricity": 0.85, "inclination_deg": 50}},
            "apogee at 104622 km; allowed is 101000 km and below",
        ),
    ],
)
def test_one_line_for_what_cannot_be(tables, says):
    with pytest.raises(ScenarioError, match=says) as refusal:
        emulated.world({**emulated.craft(), **tables})
    assert "\n" not in str(refusal.value)


def test_session_is_sixteen_bit():
    with pytest.raises(ScenarioError, match="session: 65536"):
        emulated.world(session=65536)


def test_no_satellites_at_all():
    with pytest.raises(ScenarioError, match="none"):
        emulated.world(sky={"gps": "none", "glonass": "none"})
