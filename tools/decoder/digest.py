"""What a bus says, decoded through the DBC: epochs, fixes, channels, commands.

Only frames count here, never anything the emulator or the flight software holds inside, so a third party's
software is measured by the same rule. Frames come in bus order in pieces of any size.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.gpstime import NS_PER_S, NS_PER_WEEK
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.bits import frame_bits
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import SFF_MASK, FrameBatch, concat
from gnss_hil.dbc.contract.messages import CHANNELS, HEADER_NAMES, MEASUREMENT_KINDS, VALUES
from gnss_hil.tools.decoder.almanac import AlmanacLedger
from gnss_hil.tools.decoder.command_log import CommandLedger
from gnss_hil.tools.decoder.receiver_tags import TagLedger
from gnss_hil.tools.results.geometry import distinct_pdop, distinct_satellites

Columns = Mapping[str, NDArray]

_POSITION, _POSITION_VELOCITY = 1, 2  # NavMode
_FIX_SIGNALS = {
    **{f"NAV_{a}": (f"{a.lower()}_m",) for a in "XYZ"},
    **{f"NAV_V{a}": (f"v{a.lower()}_mps",) for a in "XYZ"},
    "NAV_STATUS": ("mode", "no_fix", "satellites", "measurements", "pdop"),
    "NAV_SIGMA": ("sigma_x_m", "sigma_y_m", "sigma_z_m"),
    "NAV_CORR": ("rho_xy", "rho_xz", "rho_yz"),
}
_ATTITUDE_SIGNALS = {
    "ATT_Q01": ("q0", "q1"),
    "ATT_Q23": ("q2", "q3"),
    "ATT_RATE": ("wx_rps", "wy_rps", "wz_rps"),
}
_HELD_BACK = 2
"""Epochs kept open: an answer may come while the next epoch has begun."""


@dataclass(frozen=True, slots=True)
class Traffic:
    """Frames of one bus.

    received  frames heard, rejected ones included
    lost      frames missing by the counters of their streams
    rejected  reason -> frames
    bits      (e,) bits of each epoch
    """

    received: int
    lost: int
    rejected: Mapping[str, int]
    bits: NDArray[np.int64]


class Digest:
    """Decodes one bus.

    on_channels   is handed the channel table piece by piece (it is large)
    """

    def __init__(self, codec: Codec, on_channels: Callable[[Columns], None] | None = None):
        self._codec = codec
        self._on_channels = on_channels
        self._counters = e2e.fresh_counters()
        self._kinds = {layout.number: name for name, layout in codec.kinds.items()}
        self._mark_id = codec.can_id_of["TIME_MARK", 0]
        self._mark_nibbles = np.zeros(0, np.int64)
        self._opened = 0  # marks heard so far
        self._consumed = 0  # epochs decoded so far
        self._carry = (concat([]), np.zeros(0, np.int64))
        self._rejected: Counter[str] = Counter()
        self._lost = 0
        self._received = 0
        self._bits = _PerEpoch()
        self._faults = _PerEpoch()
        self._epochs: list[Columns] = []
        self._fixes: list[Columns] = []
        self.commands = CommandLedger()
        self.almanac = AlmanacLedger()
        self.tags = TagLedger()

    def feed(self, frames: FrameBatch) -> None:
        """More frames, in bus order."""
        if not len(frames):
            return
        screened = e2e.screen(self._codec, frames, self._counters)
        self._counters = screened.counters
        self._lost += screened.lost
        self._received += len(frames)
        for verdict, count in enumerate(np.bincount(screened.verdict)):
            if count and verdict > e2e.Verdict.LOST:
                self._rejected[e2e.Verdict(verdict).name] += int(count)
        good = screened.verdict <= e2e.Verdict.LOST
        is_mark = good & (frames.can_id == self._mark_id)
        ordinal = self._opened - 1 + np.cumsum(is_mark)
        marks = np.flatnonzero(is_mark)
        self._mark_nibbles = np.r_[self._mark_nibbles[-_HELD_BACK:], frames.data[marks, 1] >> 4]
        self._opened += len(marks)
        self._bits.add(ordinal, frame_bits(frames))
        self._faults.add(ordinal[~good], np.ones((~good).sum(), np.int64))
        self._hold(screened.frames, ordinal[good])
        self._consume(self._opened - _HELD_BACK)

    def _hold(self, frames: FrameBatch, ordinal: NDArray) -> None:
        """Keep accepted frames with the epoch they belong to: the one they are in or the one before."""
        begun = ordinal >= 0
        self._rejected["BEFORE_FIRST_MARK"] += int((~begun).sum())
        frames, ordinal = frames[begun], ordinal[begun]
        nibble_of = self._mark_nibbles[ordinal - (self._opened - len(self._mark_nibbles))]
        late = (nibble_of - (frames.data[:, 1] >> 4)) % 16
        late[~self._codec.protected_of[frames.can_id]] = 0
        keep = late < _HELD_BACK
        self._rejected["MIXED_EPOCH"] += int((~keep).sum())
        self._faults.add(ordinal[~keep], np.ones((~keep).sum(), np.int64))
        held, epochs = self._carry
        self._carry = concat([held, frames[keep]]), np.r_[epochs, (ordinal - late)[keep]]

    def _consume(self, end: int) -> None:
        """Decode all epochs before `end`."""
        if end <= self._consumed:
            return
        frames, epoch = self._carry
        ready = epoch < end
        self._carry = frames[~ready], epoch[~ready]
        begin, self._consumed = self._consumed, end
        self._decode(_ByKind(self._codec, self._kinds, frames[ready], epoch[ready] - begin), end - begin)

    def finish(self) -> None:
        """Decode what is still held."""
        self._consume(self._opened)

    def _decode(self, kinds: _ByKind, epochs: int) -> None:
        t_ns = _times(kinds, epochs)
        cells = _cells(kinds, epochs)
        fixes = _fixes(kinds, epochs)
        used, domain = _receivers(kinds, epochs)
        in_fix = cells.complete & used & fixes["valid"][:, None, None]
        sat = np.where(in_fix, cells.sat, -1)
        position = np.stack([cells.values[f"{a}_m"] for a in "xyz"], axis=-1)
        craft = np.stack([fixes[f"{a}_m"] for a in "xyz"], axis=-1)
        fixes["satellites_used"] = distinct_satellites(sat)
        fixes["pdop_distinct"] = distinct_pdop(sat, position, craft, domain)
        known = t_ns >= 0
        reported = fixes.pop("reported") & known
        self._fixes.append({"t_ns": t_ns[reported], **{k: v[reported] for k, v in fixes.items()}})
        self._epochs.append({"t_ns": t_ns, **_grids(kinds, _ATTITUDE_SIGNALS, epochs)})
        self.commands.take(t_ns, kinds)
        self.almanac.take(t_ns, kinds)
        self.tags.take(t_ns, kinds)
        if self._on_channels is not None:
            row = np.nonzero(cells.complete & known[:, None, None])
            table = {"t_ns": t_ns[row[0]], "receiver": row[1] + 1, "channel": row[2]}
            table |= {name: values[row] for name, values in cells.values.items()}
            self._on_channels({**table, "sat": cells.sat[row], "used": in_fix[row]})

    @property
    def fixes(self) -> dict[str, NDArray]:
        """One row per NAV_STATUS: t_ns, valid, x_m ... vz_mps, clock_bias_m, mode, no_fix, satellites,
        measurements, pdop, sigma_x_m .. rho_yz as the flight software says; satellites_used, pdop_distinct as
        computed here."""
        return _joined(self._fixes)

    @property
    def timeline(self) -> dict[str, NDArray]:
        """One row per time mark with an instant: t_ns, bits, faults (frames rejected), and the attitude and
        rates on the bus, q0 .. q3 and wx_rps .. wz_rps, nan where their frames are missing."""
        table = _joined(self._epochs)
        if not table:
            return {}
        known = table["t_ns"] >= 0
        counts = {"bits": self._bits.total(len(known)), "faults": self._faults.total(len(known))}
        return {name: values[known] for name, values in (table | counts).items()}

    @property
    def epochs(self) -> int:
        """Time marks heard."""
        return self._opened

    @property
    def traffic(self) -> Traffic:
        rejected = {reason: n for reason, n in sorted(self._rejected.items()) if n}
        return Traffic(self._received, self._lost, rejected, self._bits.total(self._opened))


class _PerEpoch:
    """Sums by epoch, added in pieces; what comes before the first epoch is left out."""

    def __init__(self):
        self._pieces: list[tuple[int, NDArray]] = []

    def add(self, ordinal: NDArray, values: NDArray) -> None:
        inside = ordinal >= 0
        if inside.any():
            first = int(ordinal[inside].min())
            self._pieces.append(
                (first, np.bincount(ordinal[inside] - first, values[inside]).astype(np.int64))
            )

    def total(self, epochs: int) -> NDArray[np.int64]:
        """(epochs,)"""
        total = np.zeros(epochs, np.int64)
        for first, values in self._pieces:
            total[first : first + len(values)] += values
        return total


def _joined(pieces: list[Columns]) -> dict[str, NDArray]:
    """One table of its pieces; empty if there is none."""
    return {name: np.concatenate([p[name] for p in pieces]) for name in pieces[0]} if pieces else {}


def _grids(kinds: _ByKind, signals: Mapping[str, tuple[str, ...]], epochs: int) -> dict[str, NDArray]:
    """Signals of kinds that come once an epoch, (e,) each, nan where they did not come."""
    out: dict[str, NDArray] = {}
    for kind, names in signals.items():
        row, _, values = kinds(kind)
        for name in names:
            out[name] = np.full(epochs, np.nan)
            out[name][row] = values[name]
    return out


class _ByKind:
    """Frames sorted by kind, each kind decoded once when asked for."""

    def __init__(self, codec: Codec, names: Mapping[int, str], frames: FrameBatch, epoch: NDArray):
        kind = codec.kind_of[frames.can_id & SFF_MASK].astype(np.uint8)
        order = np.argsort(kind, kind="stable")
        bounds = np.r_[0, np.cumsum(np.bincount(kind, minlength=len(names)))]
        self._rows = {name: order[bounds[i] : bounds[i + 1]] for i, name in names.items()}
        self._codec, self._frames, self._epoch = codec, frames, epoch

    def __call__(self, kind: str) -> tuple[NDArray, NDArray, dict[str, NDArray]]:
        """Epoch row (k,), receiver number (k,) and signals of the frames of a kind."""
        rows = self._rows[kind]
        number = self._codec.number_of[self._frames.can_id[rows]].astype(np.int64)
        return self._epoch[rows], number, self._codec.decode(kind, self._frames.data[rows])

    @property
    def receivers(self) -> int:
        return self._codec.receivers


def _times(kinds: _ByKind, epochs: int) -> NDArray[np.int64]:
    """(e,) GPS time of the marks [ns], -1 where the time frames are missing."""
    t_ns = np.full(epochs, -1, np.int64)
    row, _, gps = kinds("TIME_GPS")
    t_ns[row] = gps["week"] * NS_PER_WEEK + gps["second"] * NS_PER_S
    fine = np.full(epochs, -1, np.int64)
    row, _, said = kinds("TIME_FINE")
    fine[row] = said["nanosecond"]
    return np.where((t_ns >= 0) & (fine >= 0), t_ns + fine, -1)


def _fixes(kinds: _ByKind, epochs: int) -> dict[str, NDArray]:
    """The navigation block of each epoch, (e,) arrays; nan where there is none.

    A fix is valid if all frames came that its mode promises. One of mode POSITION has no velocity.
    """
    out = _grids(kinds, _FIX_SIGNALS, epochs)
    position_only = out["mode"] == _POSITION
    for axis in "xyz":
        out[f"v{axis}_mps"][position_only] = np.nan
    placed, moving = (
        ~np.isnan([out[name.format(a)] for a in "xyz"]).any(axis=0) for name in ("{}_m", "v{}_mps")
    )
    out["reported"] = ~np.isnan(out["mode"])
    out["valid"] = placed & (position_only | moving & (out["mode"] == _POSITION_VELOCITY))
    row, _, clock = kinds("NAV_CLOCK")
    order = np.argsort(-clock["item"], kind="stable")  # the lowest domain is written last and stands
    domains = order[clock["item"][order] < len(VALUES["ClockItem"]) - 1]
    out["clock_bias_m"] = np.full(epochs, np.nan)
    out["clock_bias_m"][row[domains]] = clock["bias_m"][domains]
    return out


@dataclass(frozen=True, slots=True)
class _Cells:
    """Channels on the dense grid (epochs, receivers, CHANNELS).

    complete  all ten frames came
    sat       satellite index
    values    signal name -> grid
    """

    complete: NDArray[np.bool_]
    sat: NDArray[np.int64]
    values: dict[str, NDArray]


def _cells(kinds: _ByKind, epochs: int) -> _Cells:
    shape = (epochs, kinds.receivers, CHANNELS)
    count = np.zeros(np.prod(shape), np.uint8)
    values = {}
    for kind in MEASUREMENT_KINDS:
        row, number, signals = kinds(kind)
        cell = (row * shape[1] + number - 1) * CHANNELS + signals["channel"]
        count[cell] += 1
        for name in signals.keys() - HEADER_NAMES - {"channel"}:
            grid = np.zeros(len(count), signals[name].dtype)
            grid[cell] = signals[name]
            values[name] = grid.reshape(shape)
    sat = values["sat_system"] * 64 + values["sat_number"]
    return _Cells((count == len(MEASUREMENT_KINDS)).reshape(shape), sat, values)


def _receivers(kinds: _ByKind, epochs: int) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
    """Channels in the fix (e, m, CHANNELS) by NAV_USED, and clock domains (e, m) by TAG."""
    used = np.zeros((epochs, kinds.receivers, CHANNELS), bool)
    row, _, nav = kinds("NAV_USED")
    inside = (nav["receiver"] >= 1) & (nav["receiver"] <= kinds.receivers)
    bits = nav["channels"][inside, None] >> np.arange(CHANNELS) & 1
    used[row[inside], nav["receiver"][inside] - 1] = bits.astype(bool)
    domain = np.zeros((epochs, kinds.receivers), np.int64)
    row, number, tag = kinds("TAG")
    domain[row, number - 1] = tag["clock_domain"]
    return used, domain
