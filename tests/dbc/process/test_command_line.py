"""Options as the text of a command line: what a TOML file would make of them."""

from __future__ import annotations

import argparse

import pytest

from gnss_hil.dbc.common import vehicle
from gnss_hil.dbc.process.command_line import option_value, seconds
from gnss_hil.emulator.config.scenario import Flight
from gnss_hil.flightsw.app.config import configure

pytestmark = pytest.mark.verifies(
    "dbc/process/command_line.py", what="Options of a command line", by="rules of ours", status="modelled"
)


@pytest.mark.parametrize(
    ("text", "value"),
    [("0", 0), ("-3", -3), ("2.0", 2.0), ("1e3", 1000.0), ("true", True), ("false", False), ("next", "next")],
)
def test_an_option_has_the_type_that_its_text_shows(text, value):
    found = option_value(text)
    assert found == value and type(found) is type(value)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("10ms", 0.01),
        ("35ms", 0.035),
        ("600", 600.0),
        ("600s", 600.0),
        ("10m", 600.0),
        ("1.5h", 5400.0),
        ("1d", 86400.0),
    ],
)
def test_a_duration_is_in_seconds_or_in_its_unit(text, value):
    assert seconds(text) == value


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("5parsec", "'5parsec' is not a duration; seconds, or a number with ms, s, m, h or d"),
        ("ms", "'ms' is not a duration"),
        ("0.5ms", "0.5ms; from 0.001 s"),
        ("0ms", "0ms; must be finite and greater than 0"),
    ],
)
def test_what_is_no_duration_is_told_with_the_units_there_are(text, words):
    with pytest.raises(argparse.ArgumentTypeError) as caught:
        seconds(text)
    assert str(caught.value).startswith(words)


def test_whole_numbers_are_taken_where_counts_and_where_measures_are_asked_for():
    texts = {"exclude_satellites": "0", "autonomy_after_epochs": "5", "hysteresis_deg": "2"}
    given = {name: option_value(text) for name, text in texts.items()}
    options = configure(vehicle.load(vehicle.find("soyuz-ms")), "patent", given).options
    assert (options.autonomy_after_epochs, options.hysteresis_deg) == (5, 2.0)
    with pytest.raises(ValueError, match="autonomy_after_epochs: input should be a valid integer"):
        configure(vehicle.load(vehicle.find("soyuz-ms")), "patent", {"autonomy_after_epochs": 5.5})


def test_a_scenario_keeps_the_type_of_its_options():
    given = {"flight": True, "count": 3, "metres": 0.5, "rule": "next"}
    flight = Flight(options=given)
    assert {name: type(value) for name, value in flight.options.items()} == {
        name: type(value) for name, value in given.items()
    }
