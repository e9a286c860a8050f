"""Every shipped scenario plays, and those that judge themselves are content."""

from __future__ import annotations

import json

import pytest

from emulator.scenario import shipped
from tools.cli import main


@pytest.mark.parametrize("name", shipped())
def test_it_plays_and_meets_its_expectations(name, tmp_path):
    out = tmp_path / "run"
    assert main(["run", name, "--bus", "inline", "--duration", "300", "--out", str(out), "--quiet"]) == 0
    summary = json.loads((out / "summary.json").read_text())
    assert summary["craft"]["soyuz"]["fixes"] > 250
    assert all(row["met"] for row in summary["expectations"])


def test_without_noise_truth_and_flight_agree_to_a_tenth_of_a_millimetre(tmp_path):
    """Clocks wander by 1 ms. Anything left out would show: the Shapiro delay alone is 7 mm."""
    out = tmp_path / "run"
    assert (
        main(["run", "soyuz-quiet", "--bus", "inline", "--duration", "300", "--out", str(out), "--quiet"])
        == 0
    )
    error = json.loads((out / "summary.json").read_text())["craft"]["soyuz"]["position_error_m"]
    assert error["median"] < 1e-4
    assert error["max"] < 5e-3
