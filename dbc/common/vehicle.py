"""The vehicle file: what flight software and emulator both know of the spacecraft, nominal.

TOML, one table per antenna. Body axes: x fore, y starboard, z nadir when the craft flies in orbital
attitude; origin in the centre of mass. See `dbc/vehicles/soyuz-ms.toml`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from gnss_hil.dbc.common.limits import CHANNELS, MAX_RECEIVERS
from gnss_hil.dbc.common.protection import Protection
from gnss_hil.dbc.common.shipped_files import Files
from gnss_hil.dbc.common.signals import SIGNALS, beyond_first
from gnss_hil.dbc.common.strict import Strict as Strict

Component = Annotated[float, Field(ge=-1e6, le=1e6)]
Direction = tuple[Component, Component, Component]
"""Along an axis, body axes, of any length but zero."""

Metres = Annotated[float, Field(ge=-1000, le=1000)]
Place = tuple[Metres, Metres, Metres]
"""From the centre of mass, body axes: no craft is larger."""

_SHORTEST = 1e-6


def unit_vector(name: str, direction: Direction) -> NDArray[np.float64]:
    """(3,) of length 1; ValueError for what points nowhere."""
    vector = np.array(direction, float)
    norm = float(np.linalg.norm(vector))
    if norm < _SHORTEST:
        raise ValueError(f"{name} has length {norm:.4g}; it points nowhere")
    return vector / norm


_OTHERS = tuple(signal.name for signal in SIGNALS.values() if beyond_first()[signal.value])
"""Signals beside each system's first."""


class Antenna(Strict):
    """An antenna with its receiver.

    name              for reports
    receiver          number of its receiver on the bus
    channels          of the receiver
    clock_domain      number of the oscillator that the receiver works by; the same number, the same clock
    boresight_body    the antenna's axis in body axes, of any length; or its azimuth and elevation
    boresight_azimuth_deg    the axis's angle from x (fore) towards y (starboard)
    boresight_elevation_deg  the axis's angle from the x-y plane towards -z (zenith)
    lever_arm_body_m  phase centre relative to the centre of mass, body axes
    mask_deg          largest angle off the boresight at which the antenna is given a satellite
    other_signals     that the receiver tracks beside each system's first, each on a channel of its own
    """

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 ._+-]{0,23}$")]
    receiver: Annotated[int, Field(ge=1, le=MAX_RECEIVERS)]
    channels: Annotated[int, Field(ge=1, le=CHANNELS)]
    clock_domain: Annotated[int, Field(ge=0, le=7)] = 0
    boresight_body: Direction | None = None
    boresight_azimuth_deg: Annotated[float, Field(ge=-360, le=360)] | None = None
    boresight_elevation_deg: Annotated[float, Field(ge=-90, le=90)] | None = None
    lever_arm_body_m: Place
    mask_deg: Annotated[float, Field(gt=0, le=180)]
    other_signals: tuple[Literal[_OTHERS], ...] = ()  # pyright: ignore[reportInvalidTypeForm]

    @model_validator(mode="after")
    def _signals_are_named_once(self):
        if len(set(self.other_signals)) != len(self.other_signals):
            raise ValueError(f"other_signals are {list(self.other_signals)}; each must be different")
        return self

    @model_validator(mode="after")
    def _one_boresight(self):
        angles = (self.boresight_azimuth_deg, self.boresight_elevation_deg)
        if (self.boresight_body is None) is (None in angles):
            raise ValueError(
                "give boresight_body, or boresight_azimuth_deg and boresight_elevation_deg, one of the two"
            )
        if self.boresight_body is not None and angles != (None, None):
            raise ValueError("boresight_body and an angle of it: one of the two")
        self.boresight  # noqa: B018 - points somewhere
        return self

    @property
    def boresight(self) -> NDArray[np.float64]:
        """(3,) unit vector of the axis, body axes."""
        if self.boresight_body is not None:
            return unit_vector("boresight_body", self.boresight_body)
        assert self.boresight_azimuth_deg is not None and self.boresight_elevation_deg is not None
        azimuth, elevation = np.deg2rad([self.boresight_azimuth_deg, self.boresight_elevation_deg])
        level = np.cos(elevation)
        return np.array([level * np.cos(azimuth), level * np.sin(azimuth), -np.sin(elevation)])


class ReceiverFigures(Strict):
    """What the receivers with their antennas are known to err by; flight software weighs by it.

    code_bandwidth_hz, frequency_bandwidth_hz   one-sided noise bandwidths of delay and frequency lock loops
    correlator_spacing_chips  early to late
    integration_s     before the discriminators
    multipath_m       1 sigma of reflections in pseudoranges of a GPS L1 C/A chip; by its length in others
    delay_m           1 sigma of a receiver's delay with its line, against others on the same clock
    channel_delay_m   1 sigma of a receiver's delay of a carrier of its own (GLONASS), in pseudoranges
    band_delay_m      1 sigma of what a receiver's second signals are late against its first, likewise
    code_noise_m      signal -> 1 sigma of its pseudoranges at 45 dBHz, in place of the loop's: of
                      signals that are tracked without their code
    """

    code_bandwidth_hz: Annotated[float, Field(gt=0, le=50)] = 0.5
    frequency_bandwidth_hz: Annotated[float, Field(gt=0, le=100)] = 2.0
    correlator_spacing_chips: Annotated[float, Field(ge=0.05, le=1)] = 0.5
    integration_s: Annotated[float, Field(gt=0, le=1)] = 0.02
    multipath_m: Annotated[float, Field(ge=0, le=100)] = 0.0
    delay_m: Annotated[float, Field(ge=0, le=1000)] = 0.0
    channel_delay_m: Annotated[float, Field(ge=0, le=100)] = 0.0
    band_delay_m: Annotated[float, Field(ge=0, le=100)] = 0.0
    code_noise_m: dict[
        Literal[tuple(SIGNALS)],  # pyright: ignore[reportInvalidTypeForm]
        Annotated[float, Field(gt=0, le=100)],
    ] = Field(default_factory=dict)


_USUAL_RECEIVERS = ReceiverFigures()
_USUAL_PROTECTION = Protection()


class VehicleFile(Strict):
    """A craft's antennas.

    name        of the vehicle
    receivers   what they are known to err by
    protection  when flight software uses what comes from the bus
    """

    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9-]{0,31}$")]
    receivers: ReceiverFigures = ReceiverFigures()
    protection: Protection = Protection()
    antenna: Annotated[list[Antenna], Field(min_length=1, max_length=MAX_RECEIVERS)]

    @model_validator(mode="after")
    def _receivers_count_up(self):
        numbers = [a.receiver for a in self.antenna]
        if sorted(numbers) != list(range(1, len(numbers) + 1)):
            raise ValueError(f"antenna receivers are {numbers}; each of 1 to {len(numbers)} once")
        names = [a.name for a in self.antenna]
        if len(set(names)) != len(names):
            raise ValueError(f"antenna names are {names}; each must be different")
        return self


@dataclass(frozen=True, slots=True, eq=False)
class Vehicle:
    """The antennas as arrays, row a = receiver a + 1.

    names             (m,)
    channels          (m,) int
    clock_domain      (m,) int
    boresight_body    (m, 3) unit vectors
    lever_arm_body_m  (m, 3) phase centre relative to the centre of mass [m]
    mask_rad          (m,) largest angle off boresight [rad]
    other_signals     (m,) names of signals that each receiver tracks beside the systems' first
    receivers         what all receivers are known to err by
    protection        when flight software uses what comes from the bus
    """

    name: str
    names: tuple[str, ...]
    channels: NDArray[np.int64]
    clock_domain: NDArray[np.int64]
    boresight_body: NDArray[np.float64]
    lever_arm_body_m: NDArray[np.float64]
    mask_rad: NDArray[np.float64]
    other_signals: tuple[tuple[str, ...], ...]
    receivers: ReceiverFigures = _USUAL_RECEIVERS
    protection: Protection = _USUAL_PROTECTION

    @property
    def antennas(self) -> int:
        return len(self.names)


class VehicleError(ValueError):
    """A vehicle file that cannot be used; the message is for people."""


def from_model(model: VehicleFile) -> Vehicle:
    rows = sorted(model.antenna, key=lambda a: a.receiver)
    return Vehicle(
        model.name,
        tuple(a.name for a in rows),
        np.array([a.channels for a in rows]),
        np.array([a.clock_domain for a in rows]),
        np.array([a.boresight for a in rows]),
        np.array([a.lever_arm_body_m for a in rows]),
        np.deg2rad([a.mask_deg for a in rows]),
        tuple(tuple(a.other_signals) for a in rows),
        model.receivers,
        model.protection,
    )


FILES = Files("vehicle", "gnss_hil.dbc", "vehicles", VehicleFile, VehicleError)
shipped, find = FILES.shipped, FILES.find


def parse(text: str, origin: str) -> Vehicle:
    """A vehicle from TOML text; VehicleError says what is wrong and where."""
    return from_model(FILES.checked(FILES.document(text, origin), origin))


def load(path: Path) -> Vehicle:
    """A vehicle from a file; VehicleError says what is wrong and where."""
    return from_model(FILES.checked(FILES.read(path), str(path)))


def with_unit_vectors(text: str, origin: str) -> dict[str, Any] | None:
    """The document of a vehicle file with every boresight as a unit vector, as programs of others expect it;
    None if the file has them so."""
    document = FILES.document(text, origin)
    model = FILES.checked(document, origin)
    given = [antenna.boresight_body for antenna in model.antenna]
    if all(b is not None and abs(float(np.linalg.norm(b)) - 1) <= _ROUNDED for b in given):
        return None
    for row, antenna in zip(document["antenna"], model.antenna, strict=True):
        row.pop("boresight_azimuth_deg", None)
        row.pop("boresight_elevation_deg", None)
        row["boresight_body"] = antenna.boresight.tolist()
    return document


_ROUNDED = 1e-3
"""A unit vector may be written with as few as four digits."""
