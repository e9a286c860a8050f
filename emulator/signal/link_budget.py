"""Link budget from the satellite's transmit antenna to C/N0, over both whole spheres.

Level on the way: EIRP of the satellite's block at the angle off its nadir, free space, gain of the receiving
antenna at the angle off its boresight; noise of the front end and of jammers; loss of the digital part. No
atmosphere: a craft is above it. Satellites point their antennas at the Earth's centre, and patterns are
means over azimuth: how a block turns about its nadir is not modelled. Patterns are published for L1: other
carriers leave the same aperture, which is wider for their longer waves (modelled: what L1 has at an angle,
another carrier has at that angle times f1 / f). Receiving antennas have one pattern for all carriers
(modelled).
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from gnss_hil.dbc.common import satellites, signals
from gnss_hil.dbc.common.arrays import F64, I64, Bool, Index
from gnss_hil.dbc.common.signals import SIGNALS
from gnss_hil.emulator.constellation.block_types import BLOCKS, Block, sent_signals
from gnss_hil.emulator.files import antenna_table
from gnss_hil.emulator.signal import antenna_patterns
from gnss_hil.emulator.signal.antenna_patterns import Pattern, Receive
from gnss_hil.emulator.signal.bands import BANDS, BY_SIGNAL, Band, edge_off_nadir_rad, slant_range_m
from gnss_hil.emulator.signal.geometry import angle_rad, norm

RECEIVE = ("isotropic", "cone-20deg", "cone-12deg")
"""Receive patterns of the package."""


def shipped(name: str) -> Pattern:
    """A pattern of the package; KeyError if none has that name."""
    file = resources.files("gnss_hil.emulator.data") / "patterns" / f"{name}.txt"
    if not file.is_file():
        raise KeyError(name)
    return antenna_table.parse(file.read_text("ascii"), f"{name}.txt")


def pattern_of(name: str, column: str, law_dbi: tuple[float, float]) -> Pattern:
    """A receive pattern as scenarios name it: "law", a shipped name, or a file.

    column    gain column of a file that has several
    law_dbi   gain at boresight and at 90 deg, for "law"
    FileError if there is no such name or file
    """
    if name == "law":
        return antenna_patterns.cosine_law(*law_dbi)
    if name in RECEIVE:
        return shipped(name)
    return antenna_table.read(Path(name), column)


def off_nadir_rad(satellite_m: F64, craft_m: F64) -> F64:
    """Angles (n,) [rad] at satellites (n, 3) between the Earth's centre and a craft (3,), same frame."""
    down = -satellite_m / norm(satellite_m)[:, None]
    towards = craft_m - satellite_m
    towards /= norm(towards)[:, None]
    return angle_rad(down, towards)


@dataclass(frozen=True, slots=True, eq=False)
class Transmit:
    """Transmitters.

    level_dbwm2   (b, 721) power an isotropic antenna receives, times distance squared, by angle off nadir;
                  nan in the row of signals of which nothing is known
    row           (16, 512) row of each signal, by its value on the bus, and satellite index
    sent          (16, 512) which satellites send which signal; None: as their blocks of the day do
    """

    level_dbwm2: F64
    row: Index
    sent: Bool | None = None


def transmit(row: Index, level: Literal["typical", "minimum"]) -> Transmit:
    """Transmitters with the row of each satellite (512,) in BLOCKS.

    level   "minimum": every block just keeps the interface documents' promise 5 deg above the horizon
    """
    levels = [np.full(antenna_patterns.NODES, np.nan)]
    rows = np.zeros((signals.COUNT, satellites.SATELLITES), np.int64)
    for number, block in enumerate(BLOCKS.values()):
        own = next(band for band in BANDS if band.system.value == block.system)
        for name in (own.signal.name, *block.others):
            rows[SIGNALS[name].value, row == number] = len(levels)
            levels.append(_level_dbwm2(block, own, name, level))
    return Transmit(np.array(levels), rows, sent_signals(row))


def isotropic() -> Transmit:
    """Transmitters that radiate the promised power in all directions; one row a signal."""
    row = np.repeat(np.arange(signals.COUNT)[:, None], satellites.SATELLITES, axis=1)
    return Transmit(np.repeat(BY_SIGNAL.power_dbwm2[:, None], antenna_patterns.NODES, axis=1), row)


def _level_dbwm2(block: Block, own: Band, name: str, level: str) -> F64:
    """Of one signal of a block; own: its first signal."""
    received_dbw = block.received_dbw if level == "typical" else own.received_dbw
    if name in block.others:
        received_dbw += block.others[name] - own.received_dbw
    pattern = of_carrier(shipped(block.pattern), SIGNALS[name].carrier_hz / own.signal.carrier_hz)
    edge_db = np.interp(np.degrees(edge_off_nadir_rad(own.radius_m)), pattern.angle_deg, pattern.gain_db)
    shape_db = antenna_patterns.on_grid(pattern) - edge_db
    return shape_db + received_dbw + 20 * np.log10(slant_range_m(own.radius_m))


def of_carrier(pattern: Pattern, ratio: float) -> Pattern:
    """A pattern of the same antenna at a carrier `ratio` times as high: angles are as much smaller. What is
    behind the last angle of the pattern itself is left out too."""
    if ratio == 1:
        return pattern
    end = pattern.angle_deg[-1]
    inside = pattern.angle_deg / ratio < end
    angle_deg = np.append(pattern.angle_deg[inside] / ratio, end)
    return Pattern(
        angle_deg, np.interp(angle_deg, pattern.angle_deg / ratio, pattern.gain_db), pattern.source
    )


def arriving_dbw(transmitters: Transmit, signal: I64, index: I64, off_nadir: F64, distance_m: F64) -> F64:
    """Power (n,) [dBW] an isotropic right-handed antenna receives of signals (n,), by their values on the
    bus, from satellites of these indices (n,)."""
    level = antenna_patterns.look_up(transmitters.level_dbwm2, transmitters.row[signal, index], off_nadir)
    return level - 20 * np.log10(distance_m)


@dataclass(frozen=True, slots=True, eq=False)
class Budget:
    """What stays the same over a run.

    noise_wphz   noise density at each antenna's terminals (m,) or one for all [W/Hz]
    loss_db      of the digital part: quantisation, filtering, sampling
    """

    transmitters: Transmit
    antennas: Receive
    noise_wphz: ArrayLike
    loss_db: float


def cn0_dbhz(
    budget: Budget,
    signal: I64,
    index: I64,
    off_nadir: F64,
    distance_m: F64,
    angle_rad: F64,
    jamming_wphz: ArrayLike = 0.0,
) -> F64:
    """Carrier to noise density (m, n) [dBHz].

    signal                         (n,) by its value on the bus
    index, off_nadir, distance_m   (n,) of the satellites: index, angle off their nadir [rad], distance [m]
    angle_rad                      (m, n) off the antennas' boresights
    jamming_wphz                   (m, n) density of `jamming.density_wphz` at the antennas' terminals
    """
    carrier_dbw = arriving_dbw(budget.transmitters, signal, index, off_nadir, distance_m)
    noise_wphz = np.reshape(budget.noise_wphz, (-1, 1)) + jamming_wphz
    return (
        carrier_dbw
        + antenna_patterns.gain_dbi(budget.antennas, angle_rad)
        - 10 * np.log10(noise_wphz)
        - budget.loss_db
    )
