"""What channels receive beside a structure: reflections gathered, loops settled, errors found.

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
from gnss_hil.emulator.signal import antenna_patterns
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry
from gnss_hil.emulator.signal.correlation import Correlation, band_limited, triangle
from gnss_hil.emulator.signal.geometry import angle_rad
from gnss_hil.emulator.signal.multipath import loop_errors
from gnss_hil.emulator.signal.multipath.loop_errors import CodeLoop, Discriminator
from gnss_hil.emulator.signal.structure import reflections
from gnss_hil.emulator.signal.structure.bodies import Structure, faces_at, moves
from gnss_hil.emulator.signal.structure.poses import LATER_S, Pose
from gnss_hil.emulator.signal.structure.reflections import Gain, Pairs

Scalar = TypeVar("Scalar", bound=np.generic)

_L1_WAVE_M, _NEAR = 0.19, 0.05
"""Wave length for roughness of carriers so near to it, in parts: a per cent does not change what is rough."""


class Settings(Protocol):
    """Which reflections count and how loops see them; as the parameters of the error model `multipath`."""

    @property
    def discriminator(self) -> Discriminator: ...
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
class Signals:
    """p signals between satellites and antennas.

    direct           (p,) amplitude of the direct ray, 1 free, 0 hidden
    wave_m, chip_m   (p,) lengths of carrier wave and code chip
    """

    pairs: Pairs
    direct: F64
    wave_m: F64
    chip_m: F64

    def __len__(self) -> int:
        return len(self.pairs)


@dataclass(frozen=True, slots=True, eq=False)
class Reception:
    """What p channels receive, (p,) each: errors of pseudorange, carrier phase [m] and range rate [m/s];
    level_db by which C/N0 differs from the unobstructed direct ray's, -inf without signal."""

    range_m: F64
    phase_m: F64
    rate_mps: F64
    level_db: F64


def correlation_of(settings: Settings, chip_m: float) -> Correlation:
    """The correlation function of a receiver's channel for a code of this chip length [m]."""
    if settings.bandwidth_mhz is None:
        return triangle
    return band_limited(settings.bandwidth_mhz * 1e6 * chip_m / LIGHT_MPS)


def receive_channels(settings: Settings, spacing_chips: float, at: ChannelGeometry) -> Reception:
    """What signals of a block become by reflections, for correlators spacing_chips from early to late."""
    structure = at.epochs.structure
    assert structure is not None, "the row needs one"
    # Satellites of all epochs in one row, which is that of the pose.
    flat = at.at * structure.los.shape[1] + at.row
    pairs = Pairs(at.receiver, flat, at.at if moves(structure.shape) else None)
    signals = Signals(pairs, np.where(at.hidden, 0.0, 1.0), at.wave_m, at.chip_m)
    vehicle = structure.vehicle

    def gain_dbi(rows: I64, towards: F64) -> F64:
        angle = angle_rad(vehicle.boresight_body[rows], towards)
        return antenna_patterns.look_up(at.antennas.right_dbi, at.antennas.row[rows], angle)

    return receive(
        structure.shape, structure.pose, vehicle.lever_arm_body_m, gain_dbi, signals, settings, spacing_chips
    )


def receive(
    craft: Structure,
    at: Pose,
    antenna_body_m: F64,
    gain_dbi: Gain,
    signals: Signals,
    settings: Settings,
    spacing_chips: float,
) -> Reception:
    """What p channels receive.

    antenna_body_m   (m, 3) places of the antennas, body axes
    spacing_chips    of the correlators, early to late
    """
    count = len(signals)
    if not count:
        return Reception(*np.zeros((4, 0)))
    now_m, later_m, strength = _rays(craft, settings, at, antenna_body_m, signals, gain_dbi)
    code_chips, lag_rad, level = _locks(
        settings, spacing_chips, np.concatenate((now_m, later_m)), _twice(signals.direct), _twice(strength),
        _twice(signals.wave_m), _twice(signals.chip_m),
    )  # fmt: skip
    lag, later = lag_rad.reshape(2, -1)
    turned = np.remainder(later - lag + np.pi, 2 * np.pi) - np.pi
    with np.errstate(divide="ignore"):
        level_db = 20 * np.log10(level[:count])
    cycle_m = signals.wave_m / (2 * np.pi)
    range_m = code_chips[:count] * signals.chip_m
    return Reception(range_m, lag * cycle_m, turned / LATER_S * cycle_m, level_db)


def _rays(
    craft: Structure, settings: Settings, at: Pose, antenna_body_m: F64, signals: Signals, gain_dbi: Gain
) -> tuple[F64, F64, C128]:
    """Delays now and later (p, k) [m] and coefficients (p, k) of each signal's strongest reflections."""
    pairs, wave_m = signals.pairs, signals.wave_m
    faces = faces_at(craft.surfaces, at.bodies)
    seen = reflections.find(at.bodies, faces, antenna_body_m, at.los_body, pairs, settings.nearest_m)
    a, s = pairs.antenna[seen.pair], pairs.satellite[seen.pair]
    wave_m = np.where(np.abs(wave_m / _L1_WAVE_M - 1) < _NEAR, _L1_WAVE_M, wave_m)[seen.pair]
    strength = reflections.coefficients(
        faces, seen, a, at.los_body[s], wave_m, gain_dbi, settings.cross_polar_db
    )
    later_m = reflections.delays_m(
        faces_at(craft.surfaces, at.later), seen.place, antenna_body_m[a], at.los_later[s]
    )
    row = loop_errors.strongest(
        seen.pair, len(pairs), settings.reflections, seen.delay_m, strength, settings.least_amplitude
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
    """Code errors, phases and levels (3, q) as in `loop_errors.Lock`, each code by its own correlation."""
    if not strength.any():
        return np.array((np.zeros_like(direct), np.zeros_like(direct), direct))
    out = np.empty((3, len(direct)))
    groups = np.unique(chip_m) if settings.bandwidth_mhz is not None else [None]
    for length_m in groups:
        rows = slice(None) if length_m is None else chip_m == length_m
        loop = CodeLoop(settings.discriminator, spacing_chips, correlation_of(settings, chip_m[rows][0]))
        found = loop_errors.lock(
            loop, direct[rows], delay_m[rows], strength[rows], wave_m[rows], chip_m[rows]
        )
        out[:, rows] = found.code_chips, found.lag_rad, found.level
    return out
