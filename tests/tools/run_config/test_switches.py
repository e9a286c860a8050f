"""Which factors `--on` and `--off` leave: a name counts more than "all", and nothing is said twice."""

from dataclasses import replace

import pytest

from gnss_hil.emulator.error_models.registry import FACTORS
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.run_config.config import Overrides
from gnss_hil.tools.run_config.overrides import overridden

NOISE = {"code_noise", "carrier_noise", "doppler_noise"}


def left(on=(), off=(), factors=None):
    """Names switched on in a craft that gives these factors."""
    document = {"craft": [{"factors": dict(factors or {})}]}
    told = overridden(document, Overrides(on=tuple(on), off=tuple(off)))["craft"][0]["factors"]
    assert document == {"craft": [{"factors": dict(factors or {})}]}
    return {name for name, given in told.items() if (given["enabled"] if isinstance(given, dict) else given)}


def test_one_of_all_is_left():
    assert left(on=["multipath"], off=["all"]) == {"multipath"}


def test_all_but_one():
    everything = left(on=["all"])
    assert everything > NOISE and "jamming" not in everything
    assert left(on=["all"], off=["code_noise"]) == everything - {"code_noise"}


def test_a_jammer_that_the_scenario_places_is_one_of_all():
    assert "jamming" in left(on=["all"], factors={"jamming": {"earth": []}})


def test_a_second_clock_model_is_no_part_of_all(monkeypatch):
    """There is room for one: the first row, unless the scenario or the command line names the other."""
    first = FACTORS["clock_instability"]
    monkeypatch.setitem(FACTORS, "maser", replace(first, name="maser"))

    def clocks(on, **given):
        return left(["all", *on], **given) & {"clock_instability", "maser"}

    assert clocks([]) == {"clock_instability"}
    assert clocks(["maser"]) == {"maser"}
    assert clocks([], off=["clock_instability"]) == set()
    assert clocks([], factors={"maser": {"offset_ms": 1.0}}) == {"maser"}
    assert clocks([], factors={"maser": False, "clock_instability": {"enabled": False}}) == {
        "clock_instability"
    }
    monkeypatch.setitem(FACTORS, "maser", replace(first, name="maser", default=True))
    assert clocks([], factors={"clock_instability": False}) <= {"maser"}
    assert left(off=["all"], factors={"maser": True}) == set()


@pytest.mark.parametrize("name", ["all", "code_noise"])
def test_on_and_off_at_once_is_a_mistake(name):
    with pytest.raises(Mistake, match=f"--on {name} with --off {name}: one of the two"):
        left(on=[name], off=[name])


def test_policy_and_navigator_are_overridden_apart():
    document = {"craft": [{"flight": {"policy": "patent", "navigator": "receiver_mean", "options": {}}}]}

    def flight(**overrides):
        return overridden(document, Overrides(**overrides))["craft"][0]["flight"]

    assert flight(policy="single") == {"policy": "single"}, "what belonged to the other policy goes"
    assert flight(navigator="best_antenna") == {**document["craft"][0]["flight"], "navigator": "best_antenna"}
    assert flight(policy="single", navigator="all_in_view") == {
        "policy": "single",
        "navigator": "all_in_view",
    }
