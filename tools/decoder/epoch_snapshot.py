"""One epoch: time, fix, receivers, channels, from its frames alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.dbc.contract.values import VALUES
from gnss_hil.tools.decoder.block import EPOCHS, Block
from gnss_hil.tools.decoder.channels import lists_used, used_in_fix
from gnss_hil.tools.decoder.navigation import attitudes
from gnss_hil.tools.decoder.time_marks import mark_times_ns


@dataclass(frozen=True, slots=True, eq=False)
class Fix:
    """A navigation block. `epoch` is the one it answers; position_ecef_m (3,) is nan without a fix."""

    epoch: int
    mode: str
    no_fix: str
    satellites: int
    measurements: int
    pdop: float
    position_ecef_m: F64


@dataclass(frozen=True, slots=True, eq=False)
class EpochSnapshot:
    """An epoch; grids are (receivers, CHANNELS).

    t_ns     GPS time of the mark [ns], None if its frames did not come
    fix      None if no navigation came
    states   ReceiverState of each receiver, "" if its STATUS did not come
    lock     Lock code, nan where the channel delivered nothing
    cn0_dbhz carrier to noise density, likewise
    off_rad  angle of the satellite off the antenna's boresight, nan without fix or attitude
    used     whether the channel's pseudorange is in the fix; nan where no NAV_USED came
    """

    epoch: int
    t_ns: int | None
    fix: Fix | None
    states: tuple[str, ...]
    lock: F64
    cn0_dbhz: F64
    off_rad: F64
    used: F64


def snapshot(block: Block, epoch: int, boresight_body: F64) -> EpochSnapshot:
    """The accepted frames of one epoch; boresight_body (m, 3) from the vehicle file."""
    fix = _fix(block, epoch)
    position = np.full(3, np.nan) if fix is None else fix.position_ecef_m
    satellite = np.stack([block.grid(f"SV_{axis}", f"{axis.lower()}_m")[0] for axis in "XYZ"], axis=-1)
    t_ns = int(mark_times_ns(block)[0])
    return EpochSnapshot(
        epoch,
        t_ns if t_ns >= 0 else None,
        fix,
        tuple(_state(raw) for raw in block.grid("STATUS", "state", -1)[0].tolist()),
        block.grid("RATE", "lock")[0],
        block.grid("RATE", "cn0_dbhz")[0],
        off_boresight_rad(satellite - position, _quaternion(block), boresight_body),
        np.where(lists_used(block)[0], used_in_fix(block)[0], np.nan),
    )


def off_boresight_rad(los_ecef: NDArray, q_body_from_ecef: NDArray, boresight_body: NDArray) -> NDArray:
    """(m, c) angles between lines of sight (m, c, 3) in ECEF and boresights (m, 3) in body axes [rad].

    q (4,) Hamilton, scalar first, passive. The satellite's motion during the signal's flight, 5e-6 rad, is
    left out: this is for eyes. nan in, nan out.
    """
    w, v = q_body_from_ecef[0], q_body_from_ecef[1:]
    twice = 2 * np.cross(v, boresight_body)  # body to ECEF: rotate by the quaternion itself
    boresight = (boresight_body + w * twice + np.cross(v, twice))[:, None, :]
    across = np.linalg.norm(np.cross(los_ecef, boresight), axis=-1)
    return np.arctan2(across, (los_ecef * boresight).sum(axis=-1))


def _last(block: Block, kind: str, names: Sequence[str], nibble: int | None = None) -> dict[str, Any] | None:
    """Signals of the last frame of a kind, of the epoch modulo 16 if that is given; None if none came."""
    frames = block[kind]
    rows = np.arange(len(frames))
    if nibble is not None:
        rows = rows[frames["epoch_mod16"] == nibble]
    return {name: frames[name][rows[-1]].item() for name in names} if len(rows) else None


def _fix(block: Block, epoch: int) -> Fix | None:
    """The last navigation block; at real time it may answer the epoch before."""
    names = ("epoch_mod16", "mode", "no_fix", "satellites", "measurements", "pdop")
    status = _last(block, "NAV_STATUS", names)
    if status is None:
        return None
    nibble = status["epoch_mod16"]
    axes = [_last(block, f"NAV_{axis.upper()}", (f"{axis}_m",), nibble) for axis in "xyz"]
    position = [part[f"{axis}_m"] for part, axis in zip(axes, "xyz", strict=True) if part is not None]
    if status["mode"] == 0 or len(position) < 3:
        position = [np.nan] * 3
    return Fix(
        epoch - (epoch - nibble) % EPOCHS,
        VALUES["NavMode"].get(status["mode"], str(status["mode"])),
        VALUES["NoFix"].get(status["no_fix"], str(status["no_fix"])),
        status["satellites"],
        status["measurements"],
        status["pdop"],
        np.array(position),
    )


def _quaternion(block: Block) -> F64:
    """(4,), unit; nan if its frames did not come."""
    at = attitudes(block)
    q = np.array([at[f"q{i}"][0] for i in range(4)])
    return q / np.linalg.norm(q) if q.any() else np.full(4, np.nan)


def _state(raw: int) -> str:
    return "" if raw < 0 else VALUES["ReceiverState"].get(raw, str(raw))
