"""What cannot be asked of a receiver that is real."""

import pytest

from gnss_hil.dbc.common import vehicle
from gnss_hil.emulator.assemble.recorded import _refuse
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.config.scenario import ScenarioError

PLAYED = {"name": "grace", "vehicle": "observed.toml", "observations": {"file": "x.rnx"}}
ONE = vehicle.load(vehicle.find("observed"))


@pytest.mark.parametrize(
    ("sky", "craft", "key"),
    [
        ({"ionosphere": True}, {}, r"sky\.factors\.ionosphere"),
        ({"code_bias": True}, {}, r"sky\.factors\.code_bias"),
        ({}, {"factors": {"multipath": True}}, r"craft\.grace\.factors\.multipath"),
        ({}, {"structure": "iss"}, r"craft\.grace\.structure"),
    ],
)
def test_errors_of_emulated_receivers_are_refused(sky, craft, key):
    with pytest.raises(ScenarioError, match=f"^{key}: acts on emulated receivers"):
        _refuse(scenario.Sky(factors=sky), scenario.Craft(**PLAYED, **craft), ONE)


def test_errors_of_what_satellites_report_are_not():
    _refuse(scenario.Sky(factors={"ephemeris_error": True}), scenario.Craft(**PLAYED), ONE)
