"""A block made ready for the bus: all payload words that no command changes.

Time mark, sensors, closing frames and almanac are of the craft. Words of a satellite at an antenna are made
when a channel first has it, for all epochs of the block, and hold everything but channel and phase. They do
not depend on which channel asked for them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.dbc.common.arrays import F64, I64, U8, U32, U64, Bool
from gnss_hil.dbc.contract.messages import MEASUREMENT_KINDS
from gnss_hil.emulator.environment.block import Block, Environment
from gnss_hil.emulator.environment.epoch_frames import EpochFrames, epoch_frames, one_after_another
from gnss_hil.emulator.environment.signals import Signals, signals
from gnss_hil.emulator.receivers import frames
from gnss_hil.emulator.receivers.emulated import almanac
from gnss_hil.emulator.receivers.emulated.channels import FULL, Channels
from gnss_hil.emulator.receivers.emulated.craft import Receivers
from gnss_hil.emulator.receivers.emulated.phase import Phases
from gnss_hil.emulator.receivers.observations import Observations
from gnss_hil.emulator.truth import TRUTH

LAYOUTS = 64
"""How many arrangements of channels a block remembers."""


@dataclass(frozen=True, slots=True, eq=False)
class Columns:
    """Signals as rows (r,): epoch k of the pair in place j is row j * epochs + k; rows of epochs in which a
    pair is not receivable are zero.

    words   (r, 10) payloads of the measurement frames but for channel and phase;  whole (r,) all values fit
    values  (v, r) what the words hold, by the template's names; None where no model changes it later
    """

    words: U64
    whole: Bool
    cycles: F64
    turns_cyc: F64
    arc: I64
    half_cycles: I64
    preamble: Bool
    cn0_dbhz: F64
    values: F64 | None


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """What stays on the bus while the same channels measure.

    receiver, channel, row, signal   (p,) of the channels that measure: row of the sky, signal by its value
                             on the bus;  base (p,) their first rows in Columns
    can_id, stream, order    (f,) of channels and closing frames: identifiers, protected streams, and
                             which of these frames, one after another, come first
    channel_bits   (p, 10);  closing (m, 2) words of the closing frames that depend on channels
    """

    receiver: I64
    channel: I64
    row: I64
    signal: I64
    base: I64
    can_id: U32
    stream: I64
    order: I64
    channel_bits: U64
    closing: U64


class Prepared:
    """One block of a craft, ready to be sent.

    truth   (k,) rows of `gnss_hil.emulator.truth.TRUTH`, the craft's number not yet in them
    front   frames of time mark and sensors;  almanac  those of the almanac
    """

    def __init__(self, env: Environment, receivers: Receivers, block: Block, keep_values: bool):
        self.block, self._env, self._receivers = block, env, receivers
        self._keep_values = keep_values
        self._epochs = len(block.geometry)
        self._place = np.full(block.signal.shape[1:], -1)
        self._columns: Columns | None = None
        self._layouts: dict[bytes, Layout] = {}
        codec = receivers.codec
        self._channel_shift = np.array(
            [
                int(codec.kinds[kind].shift[codec.kinds[kind].signals.index("channel")])
                for kind in MEASUREMENT_KINDS
            ],
            np.uint64,
        )
        self.front = _front(receivers, block)
        self.almanac = _almanac(receivers, block)
        self.repeats = self.front.repeats or self.almanac.repeats
        self.closing = _closing(receivers, block)
        self.truth = _truth(env, block)

    # Channels and frames.

    def layout(self, channels: Channels, warm: bool, left_out: Bool | None = None) -> Layout:
        """The frames of these channels.

        left_out  (p,) measuring channels with a value that the bus cannot carry (a range rate of 14 km/s):
                  they are left out whole, and not counted in STATUS
        """
        parts = channels.lock, channels.target, channels.commanded
        key = b"".join(part.tobytes() for part in parts) + bytes((warm,))
        key += b"" if left_out is None else left_out.tobytes()
        found = self._layouts.get(key)
        if found is None:
            if len(self._layouts) >= LAYOUTS:
                self._layouts.clear()
            found = self._layouts[key] = self._arranged(channels, warm, left_out)
        return found

    def columns(self) -> Columns:
        """All signals so far."""
        assert self._columns is not None
        return self._columns

    def met(self, rows: I64) -> Phases:
        """What the carrier loops of signals (p,) meet."""
        c = self.columns()
        slips = self._slips
        return Phases(
            c.cycles[rows],
            c.turns_cyc[rows] if self._turns else None,
            c.arc[rows],
            c.half_cycles[rows] if slips else None,
            c.preamble[rows] if slips else None,
        )

    def _arranged(self, channels: Channels, warm: bool, left_out: Bool | None) -> Layout:
        templates = self._receivers.templates
        receiver, channel = np.nonzero(channels.lock == FULL)
        if left_out is not None:
            receiver, channel = receiver[~left_out], channel[~left_out]
        column = channels.target[receiver, channel]
        base = self.rows(receiver, column)
        index = self.block.geometry.sky.index
        rank, row = self._env.carriers.place(column, len(index))
        m, kinds = templates.channel_id.shape
        closings = templates.closing_id.shape[1]
        place = np.concatenate((np.repeat(2 * receiver, kinds), np.repeat(2 * np.arange(m) + 1, closings)))
        order = np.argsort(place, kind="stable")
        of_channels = np.concatenate(
            (templates.channel_id[receiver].reshape(-1), templates.closing_id.reshape(-1))
        )
        key = np.concatenate((np.repeat(channel, kinds), np.zeros(closings * m, np.int64)))
        can_id = of_channels[order]
        tracking = np.bincount(receiver, minlength=m)
        closing, _ = templates.closing.fill(
            m,
            {
                "tag_offset_ns": 0, "clock_domain": 0, "almanac_satellites": 0,
                "frames": kinds * tracking + 1, "channels_tracking": tracking,
                "state": frames.receiver_state(channels.commanded, self._receivers.vehicle.channels, warm),
            },
        )  # fmt: skip
        return Layout(
            receiver,
            channel,
            row,
            self._env.carriers.signal[rank, satellites.system_of(index[row])],
            base,
            can_id,
            self._receivers.codec.first_stream_of[can_id] + key[order],
            order,
            channel.astype(np.uint64)[:, None] << self._channel_shift,
            _words(closing),
        )

    # Signals of pairs, made when they are first asked for.

    def rows(self, receiver: I64, column: I64) -> I64:
        """First rows in `columns` of satellites and signals in these columns of the block at receivers, (p,)
        each."""
        place = self._place[receiver, column]
        if (place < 0).any() or self._columns is None:
            new = np.unique(np.stack((receiver, column))[:, place < 0], axis=1)
            self._add(*new)
            place = self._place[receiver, column]
        return place * self._epochs

    def _add(self, antenna: I64, column: I64) -> None:
        made = 0 if self._columns is None else len(self._columns.whole) // self._epochs
        self._place[antenna, column] = made + np.arange(len(column))
        pair, epoch = np.nonzero(self.block.receivable[:, antenna, column].T)
        found = signals(self._env, self.block, epoch, antenna[pair], column[pair])
        self._turns, self._slips = found.turns_cyc is not None, found.half_cycles is not None
        new = self._filled(found, pair * self._epochs + epoch, len(column) * self._epochs)
        if self._columns is None:
            self._columns = new
            return
        old = self._columns
        self._columns = Columns(
            *(_joined(getattr(old, name), getattr(new, name)) for name in Columns.__slots__)
        )

    def _filled(self, found: Signals, at: I64, length: int) -> Columns:
        templates, sky = self._receivers.templates, self.block.geometry.sky
        values = frames.channel_values(_observations(found), sky, (found.at.at, found.at.row))
        data, fits = templates.channel.fill(len(at), values)

        def spread(column) -> Any:
            out = np.zeros((length, *np.shape(column)[1:]), np.asarray(column).dtype)
            out[at] = column
            return out

        zero = np.zeros(len(at))
        return Columns(
            words=spread(_words(data)),
            whole=spread(fits.all(axis=1)),
            cycles=spread(found.cycles),
            turns_cyc=spread(zero if found.turns_cyc is None else found.turns_cyc),
            arc=spread(found.arc),
            half_cycles=spread(0 * found.arc if found.half_cycles is None else found.half_cycles),
            preamble=spread(zero > 0 if found.preamble is None else found.preamble),
            cn0_dbhz=spread(found.at.cn0_dbhz),
            values=self._kept(values, spread, len(at)),
        )

    def _kept(self, values: dict, spread, length: int) -> F64 | None:
        if not self._keep_values:
            return None
        names = self._receivers.templates.channel.names
        return np.stack([spread(np.broadcast_to(np.asarray(values[name], float), length)) for name in names])


def _joined(old, new) -> Any:
    if old is None:
        return None
    return np.concatenate((old, new), axis=old.ndim - 1 if old.ndim == 2 and old.dtype == np.float64 else 0)


def _words(data) -> U64:
    """Payloads (..., 8) as words (...)."""
    return np.ascontiguousarray(data).view("<u8")[..., 0]


def _observations(found: Signals) -> Observations:
    """Signals as a channel would measure them, without channel, phase and slips."""
    at, none = found.at, np.zeros(len(found.at), np.int64)
    return Observations(
        receiver=at.receiver,
        channel=none,
        row=at.row,
        sat=at.sat,
        signal=at.signal,
        pseudorange_m=found.pseudorange_m,
        range_rate_mps=found.range_rate_mps,
        phase_cyc=np.zeros(len(at)),
        cn0_dbhz=at.cn0_dbhz,
        slips=none,
        half_cycle=none > 0,
        pos_ecef_m=found.pos_ecef_m,
        vel_ecef_mps=found.vel_ecef_mps,
        clock_m=found.clock_m,
        clock_drift_mps=found.clock_drift_mps,
    )


def _front(receivers: Receivers, block: Block) -> EpochFrames:
    """Time mark and sensors."""
    at = block.geometry
    marks = at.mark_ns.tolist()
    mark = np.array([gpstime.week_second_ns(t) for t in marks]).T
    leap_s = np.array([gpstime.leap_seconds(t) for t in marks])
    values = frames.mark_values(receivers.session, at.epoch, mark, leap_s, receivers.mark_source)
    data, fits = receivers.templates.mark.fill(len(at), values)
    every = np.arange(len(at))
    own = _frames(receivers, len(at), every, np.tile(receivers.templates.mark_id, (len(at), 1)), data, fits)
    return one_after_another((own, *(node.over(block) for node in receivers.sensors)))


def _almanac(receivers: Receivers, block: Block) -> EpochFrames:
    """The portion of the almanac that is sent in each epoch."""
    at, templates = block.geometry, receivers.templates
    held, antennas = receivers.almanac, receivers.vehicle.antennas
    portions = []
    for k, epoch in enumerate(at.epoch.tolist()):
        contents = at.sky.broadcast.available[k] if held is None else held.known
        portions.append(almanac.portion(contents, epoch, receivers.epochs_per_pass, antennas))
    rows, sender = (np.concatenate(part) for part in zip(*portions, strict=True))
    epoch = np.repeat(np.arange(len(at)), [len(part) for part, _ in portions])
    predicted = almanac.predictions(held, at.sky, (epoch, rows), rows, at.mark_ns[epoch])
    data, fits = templates.almanac.fill(len(rows), frames.almanac_values(at.sky.index[rows], predicted))
    return _frames(receivers, len(at), epoch, templates.almanac_id[sender], data, fits)


def _frames(receivers: Receivers, epochs: int, epoch: I64, can_id: U32, data: U8, fits: Bool) -> EpochFrames:
    """Frames of k epochs from records (r,) of f frames each: identifiers (r, f), payloads (r, f, 8)."""
    of_frame = np.repeat(epoch, can_id.shape[1])
    words = _words(data).reshape(-1)
    return epoch_frames(receivers.codec, epochs, of_frame, can_id.reshape(-1), words, fits.reshape(-1))


def _satellites_in_almanac(receivers: Receivers, block: Block) -> I64:
    """(k,) how many satellites are in the almanac."""
    available = block.geometry.sky.broadcast.available
    held = receivers.almanac
    return np.broadcast_to(available if held is None else held.known, available.shape).sum(axis=1)


def _closing(receivers: Receivers, block: Block) -> U64:
    """(k, m, 2) words of the closing frames that depend on no channel."""
    at, domain = block.geometry, receivers.vehicle.clock_domain
    m = len(domain)
    clock_s = at.clock[:, 0, domain] - at.ahead_s[:, None]
    values = {
        "tag_offset_ns": frames.tag_offset_ns(clock_s).reshape(-1),
        "clock_domain": np.tile(domain, len(at)),
        "almanac_satellites": np.repeat(_satellites_in_almanac(receivers, block), m),
        "frames": 0, "channels_tracking": 0, "state": 0,
    }  # fmt: skip
    data, _ = receivers.templates.closing.fill(len(at) * m, values)
    return _words(data).reshape(len(at), m, -1)


def _truth(env: Environment, block: Block):
    """(k,) rows of truth: place and motion at the time of the mark, all else of the latch."""
    at = block.geometry
    of_first = block.signal[..., : len(at.sky.index)]
    usable = (of_first & at.sky.broadcast.healthy[:, None]).any(axis=1)
    seen = np.zeros((len(at), satellites.SATELLITES), np.uint8)
    seen[:, at.sky.index] = usable
    rows = np.zeros(len(at), TRUTH)
    rows["t_gps_ns"] = at.mark_ns
    rows["position_ecef_m"], rows["velocity_ecef_mps"] = block.marked
    rows["quaternion_body_from_ecef"] = at.quaternion
    rows["rate_body_rps"] = at.rate_body_rps
    rows["clock_s"] = at.clock[:, 0]
    rows["in_view"] = np.packbits(seen, axis=1, bitorder="little").view("<u8")
    rows["satellites_visible"] = usable.sum(axis=1)
    return rows
