"""What every fault says of itself, whatever its kind: name, place, time, and what is expected of it."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AfterValidator, Field, field_validator, model_validator

from gnss_hil.dbc.common.near import did_you_mean
from gnss_hil.dbc.common.vehicle import Strict
from gnss_hil.emulator.faults.checks import CHECKS
from gnss_hil.emulator.faults.place import Place
from gnss_hil.emulator.faults.protect import Protection
from gnss_hil.emulator.faults.spoken import OneOrMore
from gnss_hil.emulator.faults.when import When


class FaultError(ValueError):
    """Faults that cannot be; the message is for people, one line a mistake."""


_Words = Annotated[tuple[str, ...], OneOrMore()]


def but_not(value: float, said: str) -> AfterValidator:
    """Marks a number that is not this one, with which nothing would happen."""

    def checked(found: float) -> float:
        if found == value:
            raise ValueError(said)
        return found

    return AfterValidator(checked)


class Expect(Strict):
    """What a fault is expected to lead to; nothing where nothing is said.

    detected_by     checks of the flight software of which one sees it (docs/faults.md)
    within_epochs   after its first epoch
    fix_error_m     no fix while it lasts, and until as long behind it, errs by more
    availability    share of the epochs while it lasts that have a fix, at least
    """

    detected_by: _Words = ()
    within_epochs: Annotated[int, Field(ge=0, le=1_000_000)] | None = None
    fix_error_m: Annotated[float, Field(gt=0, le=1e12)] | None = None
    availability: Annotated[float, Field(ge=0, le=1)] | None = None

    @field_validator("detected_by")
    @classmethod
    def _are_checks(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        for name in value:
            if name not in CHECKS:
                raise ValueError(f"no check '{name}'; {did_you_mean(name, CHECKS)}")
        return value

    @model_validator(mode="after")
    def _epochs_of_something(self):
        if self.within_epochs is not None and not self.detected_by:
            raise ValueError("within_epochs goes with detected_by")
        return self


class Fault(Strict):
    """A fault.

    kind     what it is: `gnss-hil faults list`
    name     in tables and plots; made of kind and place without one
    craft    on whose bus; that of every craft without one
    on       the place: text such as "rx2 RANGE", or a table
    at       the time: text such as "@2m+30s", or a table; all of the run without one
    expect   what it is expected to lead to
    """

    kind: Any  # of each kind its name
    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 ._+-]{0,63}$")] | None = None
    craft: str | None = None
    on: Place = Place()
    at: When = When()
    expect: Expect = Expect()


class Altering(Fault):
    """A fault that changes what frames carry.

    protection   what becomes of CRC and counter: recompute, keep, wrong, or a table
    """

    protection: Protection = Protection()


class Unplaced(Fault):
    """A fault that has no place: its frames are new."""

    @model_validator(mode="after")
    def _has_no_place(self) -> Any:
        if not self.on.everything:
            raise ValueError(f"on: {self.kind} takes no place; its frames are new")
        return self


class Placed(Fault):
    """A fault that has to have a place."""

    @model_validator(mode="after")
    def _has_a_place(self) -> Any:
        if self.on.everything and "on" not in self.model_fields_set:
            raise ValueError('on: which frames? on = "rx2 RANGE"; on = "all" for every frame')
        return self
