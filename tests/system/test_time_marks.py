"""When receivers latch: marks read from a receiver's clock, and from an on-board computer that is off.

A wrong instant costs metres: 7.3 m for each millisecond in this orbit, relative to the turning Earth.
"""

from __future__ import annotations

import json

import pytest

from gnss_hil.emulator.config.scenario import shipped
from gnss_hil.tools.command_line.main import main

METRES_PER_MS = (6.8, 7.8)


def position_error_m(tmp_path, clock="", factors="", *options):
    text = shipped()["soyuz"].read_text().replace("[craft.flight]", f"{clock}\n[craft.flight]") + factors
    scenario = tmp_path / "marks.toml"
    scenario.write_text(text)
    out = tmp_path / "run"
    arguments = ["run", str(scenario), "--bus", "inline", "--duration", "300", "--out", str(out), "--quiet"]
    quiet = [x for name in ("code_noise", "carrier_noise", "doppler_noise") for x in ("--off", name)]
    assert main([*arguments, "--no-report", *quiet, *options]) == 0
    craft = json.loads((out / "summary.json").read_text())["craft"]["soyuz"]
    assert craft["fixes"] > 250
    return craft["position_error_m"]


@pytest.mark.parametrize("seed", ["1", "2", "5"])
def test_marks_of_a_receiver_whose_clock_is_off_by_a_millisecond(tmp_path, seed):
    """The clock wanders between -1 ms and +1 ms, with another phase for each seed; every fix is brought to
    the mark by the offset it finds."""
    clock = "[craft.clock]\namplitude_ms = 1.0\nperiod_s = 900.0\nmark_domain = 0"
    assert position_error_m(tmp_path, clock, "", "--seed", seed)["max"] < 5e-3


@pytest.mark.parametrize("offset_ms", [1.0, -1.0])
def test_a_computer_that_does_not_know_that_it_is_off_costs_metres(tmp_path, offset_ms):
    factor = (
        f"\n[craft.factors]\nonboard_clock = {{offset_us = {1e3 * offset_ms}, drift_ppb = 0.0, walk = 0.0}}\n"
    )
    error = position_error_m(tmp_path, factors=factor)
    least, most = METRES_PER_MS
    assert least < error["median"] < most
    assert error["max"] - error["median"] < 0.3
