"""Which factors `--on` and `--off` leave: a name counts more than "all", and nothing is said twice."""

import pytest

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
