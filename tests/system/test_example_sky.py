"""The sky that ships as a file flies as its README has it, and is what the exporter writes."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from gnss_hil.tools.command_line.main import main

pytestmark = pytest.mark.verifies(
    "examples/sky",
    what="A sky of our own in a file",
    by="flown as its README has it: as many satellites and fixes as under the nominal sky it is of",
    status="validated",
)

SKY = Path(__file__).parents[2] / "examples/sky"


def summary(folder, *words):
    command = ["run", "soyuz", "--duration", "120", "--bus", "inline", "--quiet", "--no-report", *words]
    assert main([*command, "--out", str(folder)]) == 0
    return json.loads((folder / "summary.json").read_text())["craft"]["soyuz"]


def test_it_flies_as_the_nominal_sky(tmp_path):
    (command,) = re.findall(r"^    gnss-hil run soyuz (--nav .*)$", (SKY / "README.md").read_text(), re.M)
    option, name = command.split()
    nominal = summary(tmp_path / "nominal")
    of_file = summary(tmp_path / "file", option, str(SKY.parents[1] / name))
    assert of_file["fixes"] == nominal["fixes"] > 60
    assert of_file["satellites_tracked"] == nominal["satellites_tracked"]
    assert of_file["position_error_m"]["median"] == pytest.approx(
        nominal["position_error_m"]["median"], rel=0.2
    )
