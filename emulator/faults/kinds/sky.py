"""Satellites, systems and oscillators that fail, as every channel that is concerned would measure it."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.faults import signals, where
from gnss_hil.emulator.faults.alter import Alter
from gnss_hil.emulator.faults.base import Actions, Direction
from gnss_hil.emulator.faults.kinds.row import Bus, Row
from gnss_hil.emulator.faults.models import Altering, Placed, but_not
from gnss_hil.emulator.faults.place import Place
from gnss_hil.emulator.faults.ranges import Moved, Shift
from gnss_hil.emulator.faults.signals import Change
from gnss_hil.emulator.faults.where import Where

Metres = Annotated[float, Field(ge=-1e8, le=1e8)]
Rate = Annotated[float, Field(ge=-10_000, le=10_000)]
Nanoseconds = Annotated[float, Field(ge=-3e8, le=3e8)]


class RangeStep(Altering, Placed):
    """Ranges longer by a step, on a channel, a receiver, a satellite: what is at the place.

    step_m    longer by
    carrier   the carrier phase too; false: the code alone, as multipath does
    """

    kind: Literal["range-step"]
    step_m: Annotated[Metres, but_not(0, "steps by nothing")]
    carrier: bool = True


class RangeRamp(Altering, Placed):
    """Ranges that grow from 0 at the window's beginning, and range rates with them.

    rate_mps   by so much a second
    carrier    the carrier phase too
    """

    kind: Literal["range-ramp"]
    rate_mps: Annotated[Rate, but_not(0, "grows by nothing")]
    carrier: bool = True


class _Satellite(Altering):
    """A fault of satellites."""

    @model_validator(mode="after")
    def _is_a_satellite(self):
        if not (self.on.satellite or self.on.system):
            raise ValueError("on: which satellite? G12, or a system")
        return self


class SatelliteClockJump(_Satellite):
    """A satellite's clock jumps ahead, its message does not know.

    jump_ns       ahead by; its ranges become shorter by 0.3 m for each
    rate_ns_per_s   and goes so much faster
    """

    kind: Literal["satellite-clock-jump"]
    jump_ns: Nanoseconds = 0.0
    rate_ns_per_s: Annotated[float, Field(ge=-30_000, le=30_000)] = 0.0

    @model_validator(mode="after")
    def _jumps(self):
        if not (self.jump_ns or self.rate_ns_per_s):
            raise ValueError("jumps by nothing; give jump_ns or rate_ns_per_s")
        return self


class BadEphemeris(_Satellite):
    """A satellite is not where its message says: all receivers report the same coordinates, beside the true
    ones; the satellite itself stays where it is.

    radial_m, along_m, cross_m   reported farther out, ahead, to the left of its way by
    """

    kind: Literal["bad-ephemeris"]
    radial_m: Metres = 0.0
    along_m: Metres = 0.0
    cross_m: Metres = 0.0

    @model_validator(mode="after")
    def _moves(self):
        if not (self.radial_m or self.along_m or self.cross_m):
            raise ValueError("moved by nothing; give radial_m, along_m or cross_m")
        return self


class UnhealthyUsed(_Satellite):
    """A satellite says that it is unhealthy, in its message and in almanacs, and is tracked all the same."""

    kind: Literal["unhealthy-used"]


class WrongCoordinates(_Satellite):
    """A satellite is reported where none can be: its coordinates times a factor.

    factor   of the distance from the Earth's centre
    """

    kind: Literal["wrong-coordinates"]
    factor: Annotated[float, Field(ge=-4, le=4), but_not(1, "moves nothing")] = 0.5


class ConstellationBias(Altering):
    """All ranges of a system are longer.

    step_m   by so much
    """

    kind: Literal["constellation-bias"]
    step_m: Annotated[Metres, but_not(0, "steps by nothing")]

    @model_validator(mode="after")
    def _is_a_system(self):
        if not self.on.system:
            raise ValueError("on: which system? gps, glonass")
        return self


class OscillatorJump(Altering):
    """The oscillator of receivers jumps or goes faster: all their ranges, phases and time tags with it. A
    receiver on the same oscillator (the vehicle's clock_domain) that is not at the place is refused.

    jump_ns         ahead by
    rate_ns_per_s   and goes so much faster
    """

    kind: Literal["oscillator-jump"]
    jump_ns: Nanoseconds = 0.0
    rate_ns_per_s: Annotated[float, Field(ge=-10_000, le=10_000)] = 0.0
    on: Place = Place()

    @model_validator(mode="after")
    def _jumps(self):
        if not (self.jump_ns or self.rate_ns_per_s):
            raise ValueError("jumps by nothing; give jump_ns or rate_ns_per_s")
        return self


_M_PER_NS = LIGHT_MPS * 1e-9


def _shift(bus: Bus, p: Altering, step_m: float, rate_mps: float, carrier: bool = True, tag: float = 0.0):
    shift = Shift(bus.codec, step_m, rate_mps, carrier, tag)
    return {Direction.FLIGHT: Alter(bus.codec, shift, p.protection)}


def _clock(p: SatelliteClockJump, bus: Bus, place: Where) -> Actions:
    return _shift(bus, p, -p.jump_ns * _M_PER_NS, -p.rate_ns_per_s * _M_PER_NS)


def _oscillator(p: OscillatorJump, bus: Bus, place: Where) -> Actions:
    mine = where.receivers_of(p.on, bus.names) or list(range(1, len(bus.names) + 1))
    domain = list(bus.clock_domain)
    domains = {domain[r - 1] for r in mine}
    others = [f"rx{r}" for r in range(1, len(domain) + 1) if domain[r - 1] in domains and r not in mine]
    if others:
        raise ValueError(f"on: {', '.join(others)} is on the same oscillator; name it too")
    return _shift(bus, p, p.jump_ns * _M_PER_NS, p.rate_ns_per_s * _M_PER_NS, tag=1 / _M_PER_NS)


def _health(p: UnhealthyUsed, bus: Bus, place: Where) -> Actions:
    content = signals.changed([Change(signal="health", value="UNHEALTHY")], bus.codec, place.identifiers)
    return {Direction.FLIGHT: Alter(bus.codec, content, p.protection)}


def _ranging(*, rate: bool = False, phase: bool = True) -> tuple[str, ...]:
    """Messages that a shift of ranges is in."""
    return ("RANGE", *(["RATE"] if rate else []), *(["PHASE"] if phase else []))


def _coordinates(p: Altering) -> tuple[str, ...]:
    return "SV_X", "SV_Y", "SV_Z"


ROWS = (
    Row("range-step", RangeStep, "ranges longer by a step: of a channel, a receiver, a satellite",
        lambda p, bus, where: _shift(bus, p, p.step_m, 0.0, p.carrier),
        "G12 range-step +30 m @120..180", words=("range", "step"), first="step_m",
        touches=lambda p: _ranging(phase=p.carrier)),
    Row("range-ramp", RangeRamp, "ranges that grow, and range rates with them",
        lambda p, bus, where: _shift(bus, p, 0.0, p.rate_mps, p.carrier),
        "G12 range-ramp 2 m/s @30..90", words=("ramp",), first="rate_mps",
        touches=lambda p: _ranging(rate=True, phase=p.carrier)),
    Row("satellite-clock-jump", SatelliteClockJump, "a satellite's clock jumps, its message does not know",
        _clock, "G12 satellite-clock-jump 100 ns @30..90", words=("clock",), of="satellite", first="jump_ns",
        touches=lambda p: _ranging(rate=bool(p.rate_ns_per_s))),
    Row("bad-ephemeris", BadEphemeris, "a satellite is not where its message says",
        lambda p, bus, where: {Direction.FLIGHT: Alter(
            bus.codec, Moved(bus.codec, p.radial_m, p.along_m, p.cross_m), p.protection)},
        "G12 bad-ephemeris 500 m @30..90", words=("ephemeris",), first="along_m", touches=_coordinates),
    Row("unhealthy-used", UnhealthyUsed, "a satellite says it is unhealthy and is tracked all the same",
        _health, "G12 unhealthy-used @30..90", words=("unhealthy",)),
    Row("wrong-coordinates", WrongCoordinates, "a satellite is reported where none can be",
        lambda p, bus, where: {Direction.FLIGHT: Alter(
            bus.codec, Moved(bus.codec, scale=p.factor), p.protection)},
        "G12 wrong-coordinates 0.5 @30..90", words=("coordinates",), first="factor", touches=_coordinates),
    Row("constellation-bias", ConstellationBias, "all ranges of a system are longer",
        lambda p, bus, where: _shift(bus, p, p.step_m, 0.0),
        "glonass constellation-bias 50 m @30..90", words=("range", "step", "bias"), of="system",
        first="step_m", touches=lambda p: _ranging()),
    Row("oscillator-jump", OscillatorJump, "the receivers' oscillator jumps or goes faster", _oscillator,
        "oscillator-jump 1000 ns @30..90", words=("oscillator",), first="jump_ns",
        touches=lambda p: (*_ranging(rate=bool(p.rate_ns_per_s)), "TAG")),
)  # fmt: skip
