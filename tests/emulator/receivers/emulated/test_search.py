"""Receivers left alone: each rule against its own words."""

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.receivers.emulated import channels as c
from gnss_hil.emulator.receivers.emulated import search
from gnss_hil.emulator.signal.visibility import View
from tests.support import emulated

pytestmark = pytest.mark.verifies(
    "emulator/receivers/emulated/search.py",
    what="Autonomous search",
    by=(
        "four stated rules; receivers know what is visible. Outcome (6.3 distinct by elevation) agrees with "
        "the 6.2 to 6.6 of independent simulations"
    ),
    status="modelled",
)

COUNTS = np.array([2, 2])
INDEX = np.array([70, 3, 1, 66, 9])
VIEW = View(
    np.full(5, 2e7),
    np.array([0.9, 0.8, 0.1, 0.5, 0.3]),
    np.full(5, np.inf),
    np.array([[1.2, 0.1, 0.2, 0.5, 0.4], [0.3, 1.0, 0.9, 0.8, 0.1]]),
    np.tile([0.0, 0.0, 1.0], (5, 1)),
)
ALL = np.ones((2, 5), bool)


def chosen(rule, channels=None, eligible=ALL):
    channels = channels or c.fresh_channels(COUNTS)
    return search.choose(search.RULES[rule], channels, eligible, VIEW, INDEX, True).tolist()


def test_scenarios_offer_exactly_the_rules():
    assert set(get_args(scenario.Receivers.model_fields["autonomous"].annotation)) == set(search.RULES)
    with pytest.raises(scenario.ScenarioError, match=r"autonomous: .*'elevation'.*'gdop', found 'chance'"):
        scenario.parse(emulated.document(emulated.craft(receivers={"autonomous": "chance"})), "test")


def test_rules():
    assert chosen("elevation") == [[0, 1], [0, 1]]
    assert chosen("boresight") == [[1, 2], [4, 0]]
    assert chosen("prn") == [[2, 1], [2, 1]]


def test_only_eligible_satellites_and_no_more_than_there_are():
    assert chosen("elevation", eligible=np.array([[0, 0, 0, 1, 0], [0] * 5], bool)) == [[3, -1], [-1, -1]]


def test_who_stays_keeps_its_channel():
    channels = replace(c.fresh_channels(COUNTS), target=np.array([[4, 0], [1, 2]]))
    assert chosen("elevation", channels) == [[1, 0], [1, 0]]


def test_commanded_channels_and_their_satellites_are_left_alone():
    commanded = np.array([[True, False], [True, False]])
    channels = replace(c.fresh_channels(COUNTS), commanded=commanded, target=np.array([[0, -1], [-1, -1]]))
    assert chosen("elevation", channels) == [[0, 1], [-1, 0]]


@pytest.fixture(scope="module")
def tracked():
    """Satellites by receiver on the nominal sky, by rule."""

    def of(rule):
        receivers = {**emulated.QUICK, "autonomous": rule}
        block = emulated.run(emulated.world(emulated.craft(receivers=receivers, factors=emulated.QUIET)), 1)[
            1
        ][0]
        return [set(emulated.tracked(block, r).values()) for r in (1, 2, 3, 4)]

    return {rule: of(rule) for rule in search.RULES}


def test_by_elevation_all_receivers_want_nearly_the_same(tracked):
    """RU 2654321's case: 24 channels, about 6 distinct satellites."""
    assert 6 <= len(set.union(*tracked["elevation"])) <= 9


def test_by_boresight_they_spread(tracked):
    assert len(set.union(*tracked["boresight"])) >= 10


def test_by_dilution_they_spread_and_fill_their_channels(tracked):
    """Independent simulations: 10 to 17.5 distinct satellites for all rules but elevation."""
    assert 10 <= len(set.union(*tracked["gdop"])) <= 18
    assert [len(names) for names in tracked["gdop"]] == [6, 6, 6, 6]


def test_by_number_gps_comes_first(tracked):
    assert [len(names) for names in tracked["prn"]] == [6, 6, 6, 6]
    assert all(name.startswith("G") for names in tracked["prn"] for name in names)
