"""One epoch as its frames tell it: time, fix, receivers, channels. Decoded through the DBC, nothing else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.dbc.contract.messages import CHANNELS, VALUES

Grid = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Fix:
    """A navigation block. `epoch` is the one it answers; position_ecef_m (3,) is nan without a fix."""

    epoch: int
    mode: str
    no_fix: str
    satellites: int
    measurements: int
    pdop: float
    position_ecef_m: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """An epoch; grids are (receivers, CHANNELS).

    t_ns     GPS time of the mark [ns], None if its frames did not come
    fix      None if the flight software said nothing
    states   ReceiverState of each receiver, "" if its STATUS did not come
    lock     Lock code, nan where the channel delivered nothing
    cn0_dbhz carrier to noise density, likewise
    off_rad  angle of the satellite off the antenna's boresight, nan without fix or attitude
    used     whether the channel's pseudorange is in the fix
    """

    epoch: int
    t_ns: int | None
    fix: Fix | None
    states: tuple[str, ...]
    lock: Grid
    cn0_dbhz: Grid
    off_rad: Grid
    used: NDArray[np.bool_]


def sight(codec: Codec, frames: FrameBatch, epoch: int, boresight_body: NDArray[np.float64]) -> Sight:
    """What the accepted frames of an epoch say; boresight_body (m, 3) from the vehicle file."""
    said = _Epoch(codec, frames)
    fix = _fix(said, epoch)
    position = np.full(3, np.nan) if fix is None else fix.position_ecef_m
    grid = said.grid
    satellite = np.stack([grid(f"SV_{axis}", f"{axis.lower()}_m") for axis in "XYZ"], axis=-1)
    return Sight(
        epoch,
        _time(said),
        fix,
        _states(said),
        grid("RATE", "lock"),
        grid("RATE", "cn0_dbhz"),
        off_boresight_rad(satellite - position, _quaternion(said), boresight_body),
        _used(said),
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


class _Epoch:
    """Frames by kind."""

    def __init__(self, codec: Codec, frames: FrameBatch):
        self.codec, self._frames = codec, frames
        self._kind = codec.kind_of[frames.can_id]

    def all(self, kind: str) -> tuple[NDArray, dict[str, NDArray]]:
        """Receiver numbers (k,), 0-based, and signals of the frames of a kind."""
        rows = self._kind == self.codec.kinds[kind].number
        number = self.codec.number_of[self._frames.can_id[rows]].astype(np.int64) - 1
        return number, self.codec.decode(kind, self._frames.data[rows])

    def one(self, kind: str, nibble: int | None = None) -> dict[str, float] | None:
        """Signals of the last frame of a kind, of the epoch modulo 16 if that is given; None if none came."""
        _, said = self.all(kind)
        rows = np.arange(len(said["epoch_mod16"]))
        if nibble is not None:
            rows = rows[said["epoch_mod16"] == nibble]
        return {name: values[rows[-1]].item() for name, values in said.items()} if len(rows) else None

    def grid(self, kind: str, signal: str) -> Grid:
        """(m, CHANNELS) of one signal, nan where no frame came."""
        values = np.full((self.codec.receivers, CHANNELS), np.nan)
        number, said = self.all(kind)
        values[number, said["channel"]] = said[signal]
        return values


def _time(said: _Epoch) -> int | None:
    gps, fine = said.one("TIME_GPS"), said.one("TIME_FINE")
    if gps is None or fine is None:
        return None
    return gpstime.from_week(gps["week"], gps["second"], fine["nanosecond"])


def _fix(said: _Epoch, epoch: int) -> Fix | None:
    """The last navigation block; at real time it may answer the epoch before."""
    status = said.one("NAV_STATUS")
    if status is None:
        return None
    nibble = status["epoch_mod16"]
    axes = [said.one(f"NAV_{axis}", nibble) for axis in "XYZ"]
    whole = status["mode"] != 0 and all(axes)
    position = [a[f"{axis}_m"] for a, axis in zip(axes, "xyz", strict=True)] if whole else [np.nan] * 3
    return Fix(
        epoch - (epoch - nibble) % 16,
        VALUES["NavMode"].get(status["mode"], str(status["mode"])),
        VALUES["NoFix"].get(status["no_fix"], str(status["no_fix"])),
        status["satellites"],
        status["measurements"],
        status["pdop"],
        np.array(position),
    )


def _quaternion(said: _Epoch) -> NDArray[np.float64]:
    """(4,), unit; nan if its frames did not come."""
    halves = said.one("ATT_Q01"), said.one("ATT_Q23")
    if None in halves:
        return np.full(4, np.nan)
    q = np.array([half[f"q{i}"] for i, half in zip(range(4), np.repeat(halves, 2), strict=True)])
    return q / np.linalg.norm(q) if q.any() else np.full(4, np.nan)


def _states(said: _Epoch) -> tuple[str, ...]:
    states = [""] * said.codec.receivers
    number, status = said.all("STATUS")
    for receiver, state in zip(number.tolist(), status["state"].tolist(), strict=True):
        states[receiver] = VALUES["ReceiverState"].get(state, str(state))
    return tuple(states)


def _used(said: _Epoch) -> NDArray[np.bool_]:
    used = np.zeros((said.codec.receivers, CHANNELS), bool)
    _, nav = said.all("NAV_USED")
    inside = (nav["receiver"] >= 1) & (nav["receiver"] <= said.codec.receivers)
    bits = nav["channels"][inside, None] >> np.arange(CHANNELS) & 1
    used[nav["receiver"][inside] - 1] = bits.astype(bool)
    return used
