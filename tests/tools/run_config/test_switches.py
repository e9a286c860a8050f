"""Which factors `--on` and `--off` leave: a name counts more than "all", and nothing is said twice."""

from argparse import Namespace

import pytest

from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.run_config.plan import _switch

NOISE = {"code_noise", "carrier_noise", "doppler_noise"}


def left(on=(), off=(), factors=None):
    """Names switched on in a craft that gives these factors."""
    craft = {"factors": dict(factors or {})}
    _switch(craft, "craft", Namespace(on=list(on), off=list(off)))
    told = craft["factors"]
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
