"""What a craft's structure does to the signals of its channels: rays gathered, loops settled, errors found.

Two instants, some milliseconds apart, give the range rate: the carrier's error turns as the geometry does.
Nothing is drawn at random: a still structure gives a constant error, a turning one an error that beats.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.arrays import C128, F64, I64
from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.signal import multipath
from gnss_hil.emulator.signal.correlation import Correlation, band_limited, triangle
from gnss_hil.emulator.signal.structure import reflections
from gnss_hil.emulator.signal.structure.bodies import Bodies, Structure, bodies_at, faces_at
from gnss_hil.emulator.signal.structure.reflections import Gain

Scalar = TypeVar("Scalar", bound=np.generic)

LATER_S = 0.002
"""From one instant to the other: short against any beat. While a craft slews as fast as it may, a reflection
that is tracked alone changes by 6 m/s, a sixteenth of a cycle."""

_NOMINAL_WAVE_M = 0.19
"""For roughness, which a per cent of wavelength does not change."""


class Settings(Protocol):
    """What the engine is set to; as the parameters of the error model `multipath`."""

    @property
    def discriminator(self) -> multipath.Discriminator: ...
    @property
    def bandwidth_mhz(self) -> float | None: ...
    @property
    def reflections(self) -> int: ...
    @property
    def least_amplitude(self) -> float: ...
    @property
    def cross_polar_db(self) -> float: ...
    @property
    def nearest_m(self) -> float: ...


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """A craft's structure and los_body (n, 3) to the satellites at two instants LATER_S apart. With bodies of
    several instants, los_body has the satellites of one after those of another."""

    bodies: Bodies
    los_body: F64
    later: Bodies
    los_later: F64


@dataclass(frozen=True, slots=True, eq=False)
class Reception:
    """What p channels receive, (p,) each: errors of pseudorange, carrier phase [m] and range rate [m/s];
    level_db by which C/N0 differs from the unobstructed direct ray's, -inf without signal."""

    range_m: F64
    phase_m: F64
    rate_mps: F64
    level_db: F64


def los_rate_body(los_body: F64, towards_mps: F64, distance_m: F64, rate_body_rps: F64) -> F64:
    """Rates (..., n, 3) [1/s] of unit vectors los_body (..., n, 3) as the turning craft sees them.

    towards_mps     (..., n, 3) inertial velocities of the targets relative to the craft, body axes [m/s]
    distance_m      (..., n);  rate_body_rps (3,) or (..., 1, 3) of the craft relative to inertial space
                    [rad/s]
    """
    along = (towards_mps * los_body).sum(axis=-1, keepdims=True)
    return (towards_mps - along * los_body) / distance_m[..., None] - np.cross(rate_body_rps, los_body)


def pose(
    craft: Structure, los_body: F64, rate: F64, sun_body: F64, rate_body_rps: F64, t_s: float | F64
) -> Pose:
    """The structure and the sky at t_s (...) after the start and LATER_S on.

    los_body (n, 3) with its rate (n, 3), see `los_rate_body`
    sun_body, rate_body_rps (..., 3) direction of the Sun and rate of the craft, body axes
    """
    moved = sun_body - LATER_S * np.cross(rate_body_rps, sun_body)
    return Pose(
        bodies_at(craft, sun_body, t_s),
        los_body,
        bodies_at(craft, moved, t_s + LATER_S),
        los_body + LATER_S * rate,
    )


def correlation_of(settings: Settings, chip_m: float) -> Correlation:
    """The correlation function of a receiver's channel for a code of this chip length [m]."""
    if settings.bandwidth_mhz is None:
        return triangle
    return band_limited(settings.bandwidth_mhz * 1e6 * chip_m / LIGHT_MPS)


def _rays(
    craft: Structure,
    settings: Settings,
    at: Pose,
    antenna_body_m: F64,
    antenna: I64,
    satellite: I64,
    instant: I64 | None,
    gain_dbi: Gain,
) -> tuple[F64, F64, C128]:
    """Delays now and later (p, k) [m] and coefficients (p, k) of each pair's strongest reflections."""
    faces = faces_at(craft.surfaces, at.bodies)
    seen = reflections.find(
        at.bodies, craft.surfaces, faces, antenna_body_m, at.los_body, antenna, satellite, settings.nearest_m,
        instant,
    )  # fmt: skip
    a, s = antenna[seen.pair], satellite[seen.pair]
    strength = reflections.coefficients(
        craft.surfaces, faces, seen, a, at.los_body[s], np.full(len(seen), _NOMINAL_WAVE_M), gain_dbi,
        settings.cross_polar_db,
    )  # fmt: skip
    later_m = reflections.delays_m(
        faces_at(craft.surfaces, at.later), seen.place, antenna_body_m[a], at.los_later[s]
    )
    row = multipath.strongest(
        seen.pair, len(antenna), settings.reflections, seen.delay_m, strength, settings.least_amplitude
    )
    # Row -1, which stands for no reflection, finds the zeros at the end.
    delay_m, later_m, strength = (np.append(column, 0)[row] for column in (seen.delay_m, later_m, strength))
    return delay_m, later_m, strength


def _twice(column: NDArray[Scalar]) -> NDArray[Scalar]:
    """A column (p,) for both instants, (2 p,)."""
    return np.concatenate((column, column))


def _locks(
    settings: Settings,
    spacing_chips: float,
    delay_m: F64,
    direct: F64,
    strength: C128,
    wave_m: F64,
    chip_m: F64,
) -> F64:
    """Code errors, phases and levels (3, q) as in `multipath.Lock`, each code by its own correlation."""
    if not strength.any():
        return np.array((np.zeros_like(direct), np.zeros_like(direct), direct))
    out = np.empty((3, len(direct)))
    groups = np.unique(chip_m) if settings.bandwidth_mhz is not None else [None]
    for length_m in groups:
        rows = slice(None) if length_m is None else chip_m == length_m
        found = multipath.lock(
            settings.discriminator, direct[rows], delay_m[rows], strength[rows], wave_m[rows], chip_m[rows],
            spacing_chips, correlation_of(settings, chip_m[rows][0]),
        )  # fmt: skip
        out[:, rows] = found.code_chips, found.lag_rad, found.level
    return out


def receive(
    craft: Structure,
    settings: Settings,
    spacing_chips: float,
    at: Pose,
    antenna_body_m: F64,
    antenna: I64,
    satellite: I64,
    direct: F64,
    wave_m: F64,
    chip_m: F64,
    gain_dbi: Gain,
    instant: I64 | None = None,
) -> Reception:
    """What p channels receive.

    spacing_chips        of the correlators, early to late
    antenna_body_m       (m, 3) places of the antennas, body axes
    antenna, satellite   (p,) rows of antennas and of the sky
    direct               (p,) amplitude of the direct ray, 1 free, 0 hidden
    wave_m, chip_m       (p,) lengths of carrier wave and code chip
    instant              (p,) of each, where the pose is of several
    """
    if not len(antenna):
        return Reception(*np.zeros((4, 0)))
    pairs = antenna, satellite, instant
    now_m, later_m, strength = _rays(craft, settings, at, antenna_body_m, *pairs, gain_dbi)
    code_chips, lag_rad, level = _locks(
        settings, spacing_chips, np.concatenate((now_m, later_m)), _twice(direct), _twice(strength),
        _twice(wave_m), _twice(chip_m),
    )  # fmt: skip
    lag, later = lag_rad.reshape(2, -1)
    turned = np.remainder(later - lag + np.pi, 2 * np.pi) - np.pi
    count = len(antenna)
    with np.errstate(divide="ignore"):
        level_db = 20 * np.log10(level[:count])
    cycle_m = wave_m / (2 * np.pi)
    return Reception(code_chips[:count] * chip_m, lag * cycle_m, turned / LATER_S * cycle_m, level_db)
