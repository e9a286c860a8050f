"""What a made-up row declares as its options, and what is refused of it before anything flies."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Literal

import pytest
from pydantic import BaseModel, ConfigDict, Field

from gnss_hil.dbc.common import vehicle
from gnss_hil.dbc.common.vehicle import Strict
from gnss_hil.flightsw.app.config import Options, configure, options_of
from gnss_hil.flightsw.app.own_options import own_options
from gnss_hil.flightsw.assignment.registry import POLICIES
from gnss_hil.flightsw.estimation.registry import NAVIGATORS

pytestmark = pytest.mark.verifies(
    "flightsw/app/own_options.py",
    what="What options a policy or navigator of somebody else's may declare",
    by="rows of the tests' own that retype, widen, hide, and that narrow",
    status="modelled",
)

SOYUZ = vehicle.load(vehicle.find("soyuz-ms"))
NARROWED = "is an option of all flights, which can be narrowed only"
HIDDEN = "hides what the options of all flights call so"


def model(name: str, annotation, default, base=Strict):
    return type(
        "Own", (base,), {"__annotations__": {name: annotation}, name: default, "__module__": __name__}
    )


class Lax(BaseModel):
    fading: float = 1.0


class Open(Strict):
    model_config = ConfigDict(extra="allow")


class Judging(Strict):
    @property
    def rules(self):
        return None


REFUSED = [
    (model("ura_scale", str, "much"), f"ura_scale: {NARROWED}"),
    (model("ura_scale", float | None, 1.0), f"ura_scale: {NARROWED}"),
    (model("ura_scale", float, 1.0), f"ura_scale: {NARROWED}"),
    (model("ura_scale", Annotated[float, Field(ge=0, le=11)], 1.0), f"ura_scale: {NARROWED}"),
    (model("ura_scale", Annotated[float, Field(ge=0, le=10)], 11.0), f"ura_scale: {NARROWED}"),
    (model("inconsistent", Literal["fix", "hope"], "fix"), f"inconsistent: {NARROWED}"),
    (model("exclude_satellites", Annotated[float, Field(ge=0, le=16)], 1), f"exclude_satellites: {NARROWED}"),
    (model("rules", float, 1.0), f"rules: {HIDDEN}"),
    (Judging, f"rules: {HIDDEN}"),
    (Open, "model_config: extra has to be 'forbid', as of Strict"),
    (Lax, f"options: {Lax!r} is no subclass of Strict"),
    ({}, "options: {} is no subclass of Strict"),
    (None, "options: None is no subclass of Strict"),
]  # fmt: skip


@pytest.mark.parametrize(("own", "line"), REFUSED)
def test_what_is_refused_names_row_and_field(monkeypatch, own, line):
    monkeypatch.setitem(NAVIGATORS, "own", replace(NAVIGATORS["all_in_view"], name="own", options=own))
    with pytest.raises(ValueError) as caught:
        configure(SOYUZ, "prototype", navigator_name="own")
    assert str(caught.value) == f"navigator 'own': {line}"
    monkeypatch.setitem(POLICIES, "own", replace(POLICIES["prototype"], name="own", options=own))
    with pytest.raises(ValueError) as caught:
        options_of("own")
    assert str(caught.value) == f"policy 'own': {line}"


@pytest.mark.filterwarnings("ignore:Field name:UserWarning")
@pytest.mark.parametrize("name", ["copy", "json", "schema"])
def test_members_of_all_models_are_hidden_by_no_option(name):
    with pytest.raises(ValueError, match=f"^a row: {name}: {HIDDEN}$"):
        own_options("a row", model(name, float, 1.0), Options)


def test_every_mistake_has_its_line():
    own = model("ura_scale", str, "much", base=model("rules", float, 1.0))
    with pytest.raises(ValueError) as caught:
        own_options("a row", own, Options)
    assert str(caught.value).splitlines() == [f"a row: rules: {HIDDEN}", f"a row: ura_scale: {NARROWED}"]


@pytest.mark.parametrize(
    "own",
    [
        Strict,
        model("fading", float, 1.0),
        model("ura_scale", Annotated[float, Field(ge=0, le=10)], 0.0),
        model("ura_scale", Annotated[float, Field(ge=0.5, le=2)], 0.5),
        model("ura_scale", Annotated[float, Field(ge=0, le=10, multiple_of=0.5)], 0.5),
        model("inconsistent", Literal["fix"], "fix"),
        model("ionosphere_free", bool, True),
    ],
)
def test_what_adds_or_narrows_is_taken(own):
    assert own_options("a row", own, Options) is own


def test_rows_there_are_declare_what_they_may():
    for row in [*POLICIES.values(), *NAVIGATORS.values()]:
        assert own_options(row.name, row.options, Options) is row.options
