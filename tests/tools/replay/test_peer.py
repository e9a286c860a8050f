"""Which flight software a replay starts: that of the run, but for what the command line asks for."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gnss_hil.dbc.common.vehicle import Strict
from gnss_hil.emulator.config import scenario as scenarios
from gnss_hil.flightsw.estimation.registry import NAVIGATORS, NavigatorRow
from gnss_hil.tools.replay import peer
from gnss_hil.tools.replay.source import Source

RAY, IONOSPHERE_FREE = "ray_height_km=70.0", "ionosphere_free=true"


@pytest.fixture
def source() -> Source:
    path = scenarios.find("soyuz")
    document = scenarios.read(path)
    document["craft"][0]["flight"] = {
        "policy": "prototype", "navigator": "best_antenna",
        "options": {"ray_height_km": 70.0, "ionosphere_free": True},
    }  # fmt: skip
    recorded: Any = None
    return Source(recorded, Path("run"), scenarios.parse(document, str(path)), "soyuz", 0, Path("v.toml"))


def command(source: Source, policy=None, navigator=None, options=()) -> tuple[str, str | None, list[str]]:
    """Policy, navigator and options that the flight software is started with."""
    words = peer.flight_command(source, "embedded:b", policy, navigator, options)
    assert words[words.index("--vehicle") + 1] == "v.toml"
    given = [value for word, value in itertools.pairwise(words) if word == "--option"]
    navigated = words[words.index("--navigator") + 1] if "--navigator" in words else None
    return words[words.index("--policy") + 1], navigated, given


def test_the_flight_software_is_as_the_run_had_it(source):
    assert command(source) == ("prototype", "best_antenna", [RAY, IONOSPHERE_FREE])


def test_another_navigator_leaves_policy_and_options(source):
    assert command(source, navigator="all_in_view") == ("prototype", "all_in_view", [RAY, IONOSPHERE_FREE])


def test_another_policy_comes_without_the_runs_navigator_and_options(source):
    assert command(source, "patent") == ("patent", None, [])
    asked = command(source, "patent", "all_in_view", ["ray_height_km=60"])
    assert asked == ("patent", "all_in_view", ["ray_height_km=60"])


def test_an_option_that_is_given_replaces_the_runs(source):
    assert command(source, options=["ray_height_km=60"])[2] == [IONOSPHERE_FREE, "ray_height_km=60"]


def test_an_option_given_twice_is_left_to_the_flight_software_to_refuse(source):
    twice = ["ray_height_km=60", "ray_height_km=50"]
    assert command(source, options=twice)[2] == [IONOSPHERE_FREE, *twice]


def test_another_navigator_comes_without_the_options_of_the_runs_alone(source, monkeypatch):
    class Fading(Strict):
        fading: float = 1.0

    row = NavigatorRow("fading", NAVIGATORS["best_antenna"].build, "", "", Fading)
    monkeypatch.setitem(NAVIGATORS, "fading", row)
    flight = {"policy": "patent", "navigator": "fading", "options": {"fading": 0.9, "hysteresis_deg": 1}}
    craft = source.scenario.craft[0].model_copy(update={"flight": scenarios.Flight(**flight)})
    faded = replace(source, scenario=source.scenario.model_copy(update={"craft": [craft]}))
    assert command(faded)[2] == ["fading=0.9", "hysteresis_deg=1"]
    assert command(faded, navigator="all_in_view")[2] == ["hysteresis_deg=1"]
