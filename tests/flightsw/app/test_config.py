"""Options of a flight: those of all, of the policy and of the navigator, from wherever they are given.

The navigator here is the tests' own, with an option that no file of the flight software names.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from typing import Annotated

import pytest
from jsonschema import Draft202012Validator
from pydantic import Field

from gnss_hil.dbc.common import vehicle
from gnss_hil.dbc.common.vehicle import Strict
from gnss_hil.emulator.config import scenario
from gnss_hil.flightsw import __main__ as process
from gnss_hil.flightsw.app.config import Options, carried_over, configure, options_of
from gnss_hil.flightsw.estimation.all_in_view import all_in_view
from gnss_hil.flightsw.estimation.registry import NAVIGATORS, NavigatorRow
from gnss_hil.flightsw.estimation.snapshot import SnapshotNavigator
from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.run_config import plan
from gnss_hil.tools.run_config.config import Overrides
from gnss_hil.tools.run_config.overrides import overridden
from gnss_hil.tools.schema.json_schema import schema
from gnss_hil.tools.schema.page import page
from tests.support.flights import SKY, fly, soyuz
from tests.support.flown import FakeBus

pytestmark = pytest.mark.verifies(
    "flightsw/app/config.py",
    "flightsw/estimation/registry.py",
    what="Options of policy and navigator",
    by="a navigator of the tests' own, whose option comes from command lines, scenario files and programs",
    status="modelled",
)

SOYUZ = vehicle.load(vehicle.find("soyuz-ms"))


class FadingOptions(Strict):
    fading: Annotated[float, Field(gt=0, le=1, description="what a second leaves of the past's weight")] = 1.0


@dataclass(frozen=True)
class Fading(SnapshotNavigator):
    """All in view, whose covariance grows with the square of the fading factor."""

    fading: float

    def update(self, state, z, inputs):
        state, solution = SnapshotNavigator.update(self, state, z, inputs)
        if solution.fix is None:
            return state, solution
        covariance = solution.fix.covariance_m2 / self.fading**2
        return state, replace(solution, fix=replace(solution.fix, covariance_m2=covariance))


@pytest.fixture
def fading(monkeypatch):
    row = NavigatorRow("fading", lambda o: Fading(all_in_view, o.fading), "made up", "forgets", FadingOptions)
    monkeypatch.setitem(NAVIGATORS, "fading", row)


def of_process(*words: str):
    """What the flight process is configured with by its command line."""
    parser = argparse.ArgumentParser()
    process.add_arguments(parser)
    return process._config(parser.parse_args(["--vehicle", "soyuz-ms", "--bus", "-", *words]))


def test_a_navigators_option_reaches_it_and_changes_what_is_flown(fading):
    covariances = []
    for factor in (1.0, 0.5):
        config = configure(SOYUZ, "patent", {"fading": factor}, navigator_name="fading")
        states, _, _ = fly(FakeBus(soyuz(), SKY), config, 3)
        covariances.append(states[-1].solution.fix.covariance_m2)
    assert covariances[1] == pytest.approx(4 * covariances[0])


def test_from_the_command_line_of_the_flight_process(fading):
    assert of_process("--navigator", "fading", "--option", "fading=0.9").navigator.fading == 0.9
    assert of_process("--navigator", "fading").navigator.fading == 1.0


def test_from_the_command_line_of_a_run(fading, tmp_path, monkeypatch):
    built = []
    row = NAVIGATORS["fading"]
    seen = replace(row, build=lambda o: built.append(o.fading) or row.build(o))
    monkeypatch.setitem(NAVIGATORS, "fading", seen)
    words = ["run", "soyuz", "--duration", "2", "--bus", "inline", "--quiet", "--out", str(tmp_path / "run")]
    assert main([*words, "--navigator", "fading", "--option", "fading=0.9"]) == 0
    assert set(built) == {0.9}
    assert "fading = 0.9" in (tmp_path / "run/scenario.toml").read_text()


def test_from_a_scenario_file(fading, tmp_path):
    more = 'navigator = "fading"\noptions = { fading = 0.8, overflow = "next" }\n'
    (tmp_path / "faded.toml").write_text(scenario.shipped()["soyuz"].read_text() + more)
    flown = plan.make(str(tmp_path / "faded.toml")).flights[0]
    assert flown.navigator.fading == 0.8 and flown.options.overflow == "next"


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (
            ["--navigator", "fading", "--option", "fading=1.5"],
            "gnss-hil: craft soyuz: policy 'patent', navigator 'fading': fading: input should be less than "
            "or equal to 1, found 1.5",
        ),
        (
            ["--navigator", "fading", "--option", "fading=often"],
            "gnss-hil: craft soyuz: policy 'patent', navigator 'fading': fading: input should be a valid "
            "number, found 'often'",
        ),
        (
            ["--option", "fading=0.9"],
            "gnss-hil: craft soyuz: policy 'patent', navigator 'all_in_view': fading: unknown option; there "
            f"are {', '.join(sorted(options_of('patent').model_fields))}",
        ),
    ],
)
def test_what_is_wrong_with_it_is_one_line(fading, words, line, capsys):
    assert main(["run", "soyuz", "--duration", "2", *words]) == 2
    assert capsys.readouterr().err.splitlines() == [line]


def test_every_mistake_has_its_line():
    with pytest.raises(ValueError) as caught:
        configure(SOYUZ, "single", {"fading": 1, "ura_scale": -1, "overflow": "drop"})
    assert [line.split(": ")[1] for line in str(caught.value).splitlines()] == [
        "fading",
        "overflow",
        "ura_scale",
    ]


def test_options_are_those_of_all_flights_and_of_policy_and_navigator(fading):
    common, patent = set(Options.model_fields), {"mask_reading", "overflow", "hysteresis_deg"}
    assert set(options_of("prototype").model_fields) == common
    assert set(options_of("patent", "fading").model_fields) == common | patent | {"fading"}
    assert set(options_of("single", "fading").model_fields) == common | {"fading"}


def test_another_navigator_comes_without_the_options_of_the_one_it_replaces(fading):
    given = {"fading": 0.9, "overflow": "next", "misspelt": 1}
    assert carried_over(given, "patent", "fading", "best_antenna") == {"overflow": "next", "misspelt": 1}
    assert carried_over(given, "patent", "fading", "fading") == given
    document = {"craft": [{"flight": {"navigator": "fading", "options": {"fading": 0.9, "ura_scale": 0.0}}}]}
    changed = overridden(document, Overrides(navigator="all_in_view"))
    assert changed["craft"][0]["flight"] == {"navigator": "all_in_view", "options": {"ura_scale": 0.0}}
    unknown = overridden(document, Overrides(navigator="none_such"))
    assert unknown["craft"][0]["flight"]["options"] == {"fading": 0.9, "ura_scale": 0.0}


def test_schema_and_page_know_it(fading):
    defined = schema("scenario")["$defs"]
    valid = Draft202012Validator({"$defs": defined, **defined["Flight"]})
    assert valid.is_valid({"navigator": "fading", "options": {"fading": 0.9}})
    assert not valid.is_valid({"options": {"fading": 1.5}})
    assert not valid.is_valid({"options": {"fade": 0.9}})
    assert "| `fading` | number (0, 1] |" in page() and "(of navigator `fading`)" in page()
