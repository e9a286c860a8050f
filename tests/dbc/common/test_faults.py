"""What is wrong with a file, in lines that a person can act on."""

from __future__ import annotations

from copy import deepcopy

import pytest

from gnss_hil.dbc.common import model_tree, vehicle
from gnss_hil.dbc.common.vehicle import VehicleFile
from gnss_hil.emulator.config import scenario as scenarios
from gnss_hil.emulator.config.scenario import Scenario

pytestmark = pytest.mark.verifies(
    "dbc/common/faults.py",
    "dbc/common/model_tree.py",
    what="Mistakes in files, told",
    by="lines for each kind of mistake; no name of a class in any of them",
    status="validated",
)

BASE = scenarios.read(scenarios.shipped()["soyuz"])
CRAFT = ("craft", 0)


def told(path: tuple, value) -> list[str]:
    document = deepcopy(BASE)
    owner = document
    for part in path[:-1]:
        owner = owner[part] if isinstance(part, int) else owner.setdefault(part, {})
    owner[path[-1]] = value
    with pytest.raises(scenarios.ScenarioError) as caught:
        scenarios.parse(document, "s.toml")
    return str(caught.value).splitlines()


@pytest.mark.parametrize(
    ("path", "value", "line"),
    [
        (("sede",), 5, "sede: unknown key; did you mean 'seed'?"),
        (("duration_s",), 5, "duration_s: unknown key; [time] has one"),
        ((*CRAFT, "orbit", "altitud_km"), 5, "altitud_km: unknown key; did you mean 'altitude_km'?"),
        ((*CRAFT, "factors", "ionosphere"), {}, "ionosphere: unknown key; [sky.factors] has one"),
        ((*CRAFT, "factors", "code_nosie"), True, "code_nosie: unknown key; did you mean 'code_noise'?"),
        (("craft",), {"name": "a"}, "craft: there may be several: write [[craft]], found [craft]"),
        (("craft",), [5], "craft.0: must be a table, written [[craft]], found 5"),
        (("time",), [{}], "time: must be a table, written [time], found a list"),
        ((*CRAFT, "orbit"), 5, "craft.0.orbit: must be a table, written [craft.orbit], found 5"),
        (("time", "start_gps"), 5, "must be a date and time, as in 2012-10-31T00:15:00, found 5"),
        ((*CRAFT, "flight", "options"), {"a": [3]}, "should be a valid boolean or a valid integer or"),
        (("sky", "gps"), 5, "sky.gps: input should be a valid string or must be a list, found 5"),
        (("sky", "gps"), ["a", 5], "sky.gps.1: input should be a valid string, found 5"),
        ((*CRAFT, "attitude", "mode"), "ofset", "; did you mean 'offset'?"),
        (("expect", "a.b"), {"mx": 3}, "expect.a.b.mx: unknown key; did you mean 'max'?"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_line(path, value, line):
    (found,) = [
        one for one in told(path, value) if not one.endswith("expects nothing; give min, max or both")
    ]
    assert found.startswith("s.toml: ") and line in found


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("mask_dg = 3", "antenna.0.mask_dg: unknown key; did you mean 'mask_deg'?"),
        ("mask = 3", "antenna.0.mask: unknown key; did you mean 'mask_deg'?"),
    ],
)
def test_vehicle_files_likewise(words, line):
    text = (
        vehicle.shipped()["soyuz-ms"].read_text().replace("mask_deg = 85.0", f"mask_deg = 85.0\n{words}", 1)
    )
    with pytest.raises(vehicle.VehicleError) as caught:
        vehicle.parse(text, "v.toml")
    assert str(caught.value) == f"v.toml: {line}"


def test_one_antenna_written_as_a_table_is_told():
    text = vehicle.shipped()["observed"].read_text().replace("[[antenna]]", "[antenna]")
    with pytest.raises(vehicle.VehicleError, match=r"antenna: there may be several: write \[\[antenna\]\]"):
        vehicle.parse(text, "v.toml")


@pytest.mark.parametrize("model", [Scenario, VehicleFile])
def test_no_line_names_a_class_of_ours(model):
    """Every table and list of the model is given a number, and every value a table."""
    names = {"Strict", "Scenario", "Orbit", "Craft", "Params", "instance", "dictionary", "NoneType"}
    for path, _ in model_tree.values(model):
        for depth in range(1, len(path) + 1):
            if isinstance(path[depth - 1], int) or model is VehicleFile:
                continue
            for value in (5, {"nothing": {"like": "this"}}, [[]], "text"):
                document: dict = deepcopy(BASE)
                owner = document
                for part in path[: depth - 1]:
                    owner = (
                        owner[part]
                        if isinstance(part, int) and owner
                        else owner.setdefault(part, {})
                        if isinstance(owner, dict)
                        else {}
                    )
                if not isinstance(owner, dict):
                    continue
                owner[path[depth - 1]] = value
                try:
                    scenarios.parse(document, "s.toml")
                except scenarios.ScenarioError as error:
                    assert not names & set(str(error).replace("'", " ").split()), error


def test_keys_of_the_models():
    assert model_tree.keys_of(model_tree.at(Scenario, ("craft", 0, "clock"))) == [
        "amplitude_ms",
        "period_s",
        "mark_domain",
    ]
    assert model_tree.elsewhere(Scenario, "altitude_km") == ["[craft.orbit]"]
    assert model_tree.at(Scenario, ("craft", "clock")) is None
    assert (("craft", 0, "orbit", "altitude_km")) in dict(model_tree.values(Scenario))
