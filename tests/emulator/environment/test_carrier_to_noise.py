"""The link budget in a run: rich and plain agree where they say the same; jammers take satellites away."""

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites
from gnss_hil.emulator.config.scenario import ScenarioError
from tests.support import emulated

pytestmark = pytest.mark.verifies(
    "emulator/environment/carrier_to_noise.py",
    what="Signal levels in a run",
    by="the promise of IS-GPS-200 worked out by hand; a rich budget of plain parts is the plain one",
    status="modelled",
)


def scene(factors):
    return emulated.epoch_at(emulated.world(emulated.craft(factors={**emulated.QUIET, **factors})), 0)


def test_the_rich_budget_with_plain_parts_is_the_plain_one():
    plain, rich = scene({}), scene({"receive_pattern": True})
    assert np.allclose(rich.cn0_dbhz, plain.cn0_dbhz, atol=0.01)  # the table of the law has steps of 0.25 deg


def test_the_level_in_a_run_is_that_of_a_hand():
    """IS-GPS-200 promises -158.5 dBW 5 deg above the horizon, 25,235.6 km away; the loss is a loss."""
    link = {"antenna_temperature_k": 100.0, "line_loss_db": 0.0, "noise_figure_db": 0.0}
    lossy = scene({
        "receive_pattern": {"pattern": "isotropic"}, "link_budget": {**link, "implementation_loss_db": 2.5},
    })  # fmt: skip
    gps = (satellites.system_of(lossy.sky.index) == satellites.GPS) & lossy.in_sight
    received_dbw = -158.5 + 20 * np.log10(25_235_600 / lossy.view.distance_m[gps])
    by_hand = received_dbw - 10 * np.log10(1.380649e-23 * 100.0) - 2.5
    assert lossy.cn0_dbhz[:, gps] == pytest.approx(np.tile(by_hand, (4, 1)), abs=0.01)


def test_typical_transmitters_are_stronger_than_promised_ones():
    typical, least = (scene({"transmit_pattern": {"level": level}}) for level in ("typical", "minimum"))
    seen = typical.in_sight
    assert np.median(typical.cn0_dbhz[:, seen] - least.cn0_dbhz[:, seen]) > 1.0


def test_a_jammer_in_sight_takes_satellites_away():
    """1 kW of noise in the craft's own neighbourhood."""
    body = {"direction_body": [0.0, 0.0, -1.0], "received_dbw": -100.0, "bandwidth_mhz": 20.0}
    jammed = scene({"jamming": {"body": [body]}})
    assert jammed.signal.sum() < scene({}).signal.sum()


def test_blocks_of_another_system_are_refused():
    with pytest.raises(
        ScenarioError, match=r"craft\.soyuz\.factors: satellite R05 cannot be of block gps-iir"
    ):
        scene({"transmit_pattern": {"blocks": {"R05": "gps-iir"}}})
