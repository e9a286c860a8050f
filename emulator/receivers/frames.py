"""An epoch's frames of one craft: what its receivers and time source put on the bus.

Order: time mark, answers to commands, sensors (`gnss_hil.emulator.sensors`); for each receiver its channels,
tag and status; almanac; heartbeats. These are arrows 2 -> 3, 2 -> 7 and 4 -> 5 of RU 2706636 C1.

Modelled, so constant on the bus: every node runs since its first start (RUNNING, boot_count 1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.dbc.common.arrays import I64, U8, U32, U64, Bool, Ints
from gnss_hil.dbc.contract.batch_codec import Form, form
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import WIDTH, FrameBatch
from gnss_hil.dbc.contract.messages import MEASUREMENT_KINDS, node_names
from gnss_hil.dbc.contract.values import VALUES
from gnss_hil.emulator.constellation.almanac.orbits import Predictions
from gnss_hil.emulator.constellation.sky import SkyState
from gnss_hil.emulator.receivers.emulated.channels import FULL
from gnss_hil.emulator.receivers.emulated.commands import Commands
from gnss_hil.emulator.receivers.observations import Observations
from gnss_hil.emulator.signal.ionosphere.klobuchar import Coefficients

RECEIVER_STATE = {label: raw for raw, label in VALUES["ReceiverState"].items()}
_RUNNING = next(raw for raw, label in VALUES["NodeState"].items() if label == "RUNNING")

CN0_TOP_DBHZ = 63.75
AGE_TOP_H = 255
"""Where C/N0 and the age of an almanac, ten days, end on the bus: more is reported as this."""

COUNTER_HZ = 10e6
"""Counter by which a receiver tags its latch, to 100 ns: diagnostic. Clocks are found from pseudoranges."""

_MARK = ("TIME_MARK", "TIME_GPS", "TIME_FINE")
_CLOSING = ("TAG", "STATUS")
_IONOSPHERE = ("IONO_ALPHA", "IONO_BETA")
_ALMANAC = ("ALM_XY", "ALM_Z", "ALM_V")

Payloads = U8


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """Frames in order: identifiers (n,) and payloads (n, 8)."""

    can_id: U32
    data: Payloads


@dataclass(frozen=True, slots=True)
class PhaseBits:
    """Where the measurement frames carry what depends on a channel's past.

    frame   which of a channel's frames;  factor  of the carrier phase [cycles];  mask, shift of it
    slips, half_cycle   shifts of the two
    """

    frame: int
    factor: float
    mask: np.uint64
    shift: np.uint64
    slips: np.uint64
    half_cycle: np.uint64

    def word(self, cycles: NDArray, slips: I64, half_cycle: Bool) -> U64:
        """(p,) bits of the frame, of phases within their range."""
        raw = np.rint(cycles / self.factor).astype(np.int64).view(np.uint64)
        flags = (slips.astype(np.uint64) << self.slips) | (half_cycle.astype(np.uint64) << self.half_cycle)
        return ((raw & self.mask) << self.shift) | flags


def _phase_bits(codec: Codec) -> PhaseBits:
    layout = codec.kinds["PHASE"]
    phase, slips, half = (layout.signals.index(name) for name in ("phase_cyc", "slips", "half_cycle"))
    return PhaseBits(
        MEASUREMENT_KINDS.index("PHASE"), float(layout.factor[phase]), layout.mask[phase],
        layout.shift[phase], layout.shift[slips], layout.shift[half],
    )  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class FrameTemplates:
    """Forms and identifiers of one craft; identifier tables are (m, k) by receiver, the mark's (1, k);
    beat_stream, protected streams of the heartbeats."""

    mark: Form
    channel: Form
    closing: Form
    almanac: Form
    answer: Form
    mark_id: U32
    channel_id: U32
    closing_id: U32
    almanac_id: U32
    answer_id: U32
    heartbeats: Part
    beat_stream: I64
    phase: PhaseBits

    @property
    def beat_words(self) -> U64:
        return self.heartbeats.data.view("<u8")[:, 0]


def frame_templates(
    codec: Codec, receivers: int, sensors: Sequence[str], ionosphere: Coefficients | None = None
) -> FrameTemplates:
    """Of a craft with receivers and the nodes of its sensors; ionosphere as satellites broadcast it."""

    def identifiers(kinds: Sequence[str], number: int) -> list[int]:
        return [codec.can_id_of[kind, number] for kind in kinds]

    def by_receiver(kinds):
        return np.array([identifiers(kinds, r + 1) for r in range(receivers)], np.uint32)

    heartbeats = _constant(codec, receivers, sensors, ionosphere)
    return FrameTemplates(
        mark=form(codec, _MARK),
        channel=form(codec, MEASUREMENT_KINDS),
        closing=form(codec, _CLOSING),
        almanac=form(codec, _ALMANAC),
        answer=form(codec, ("ACK",)),
        mark_id=np.array([identifiers(_MARK, 0)], np.uint32),
        channel_id=by_receiver(MEASUREMENT_KINDS),
        closing_id=by_receiver(_CLOSING),
        almanac_id=by_receiver(_ALMANAC),
        answer_id=by_receiver(("ACK",)),
        heartbeats=heartbeats,
        beat_stream=codec.key_of(heartbeats.can_id, heartbeats.data),
        phase=_phase_bits(codec),
    )


def _constant(codec: Codec, receivers: int, sensors: Sequence[str], ionosphere: Coefficients | None) -> Part:
    """What is the same in every epoch: heartbeats, behind the ionosphere of each receiver."""
    beats = _heartbeats(codec, receivers, sensors)
    if ionosphere is None:
        return beats
    can_id = [codec.can_id_of[kind, r + 1] for r in range(receivers) for kind in _IONOSPHERE]
    alpha, beta = (
        codec.encode(kind, {f"{name}{k}": value for k, value in enumerate(getattr(ionosphere, name))}, 1)
        for kind, name in zip(_IONOSPHERE, ("alpha", "beta"), strict=True)
    )
    data = np.tile(np.concatenate((alpha, beta)), (receivers, 1))
    return Part(np.concatenate((np.array(can_id, np.uint32), beats.can_id)), np.vstack((data, beats.data)))


def _heartbeats(codec: Codec, receivers: int, sensors: Sequence[str]) -> Part:
    """They are the same in every epoch."""
    number = node_names(receivers)
    nodes = [*range(1, receivers + 1), *(number[node] for node in sensors), number["TIME"]]
    values: dict[str, Any] = {"state": _RUNNING, "boot_count": 1, "contract_hash": codec.hash}
    can_id = np.array([codec.can_id_of["HEARTBEAT", node] for node in nodes], np.uint32)
    return Part(can_id, codec.encode("HEARTBEAT", values, len(nodes)))


def _part(template: Form, can_id: U32, values: dict) -> Part:
    """Frames of a filled form with identifiers (n, k); one with a value that does not fit is not sent."""
    data, fits = template.fill(len(can_id), values)
    if fits.all():
        return Part(can_id.reshape(-1), data.reshape(-1, WIDTH))
    return Part(can_id[fits], data[fits])


def mark_part(
    templates: FrameTemplates, session: int, epoch: int, t_ns: int, leap_s: int, mark_clock: int
) -> Part:
    """The time mark.

    t_ns, mark_clock   what the mark shows, and the clock that showed it (table "MarkClock")
    """
    mark = gpstime.week_second_ns(t_ns)
    return _part(templates.mark, templates.mark_id, mark_values(session, epoch, mark, leap_s, mark_clock))


def mark_values(session, epoch, mark, leap_s, mark_clock) -> dict:
    """Signals of the time mark by name, of one epoch or of k: mark is week, second, nanosecond."""
    week, second, nanosecond = mark
    return {
        "session": session, "epoch": epoch,
        "week": week, "second": second, "nanosecond": nanosecond, "leap": leap_s, "mark_clock": mark_clock,
    }  # fmt: skip


def receiver_state(commanded: Bool, counts: I64, warm: bool) -> I64:
    """(m,) START while the unit is cold, COMMANDED once a command has set any channel of a receiver.

    commanded (m, k) channels;  counts (m,) of channels that a receiver has
    """
    exists = np.arange(commanded.shape[1]) < counts[:, None]
    obeys = (commanded & exists).any(axis=1)
    return np.where(obeys, RECEIVER_STATE["COMMANDED"], RECEIVER_STATE["AUTONOMOUS" if warm else "START"])


def answers_part(templates: FrameTemplates, commands: Commands, result: I64) -> Part:
    """Answers in the order the commands came."""
    values = {
        "channel": commands.channel,
        "result": result,
        "sat_system": satellites.system_of(commands.sat),
        "sat_number": satellites.number_of(commands.sat),
        "transaction": commands.transaction,
    }
    return _part(templates.answer, templates.answer_id[commands.receiver - 1], values)


def tag_offset_ns(clock_s: NDArray) -> NDArray:
    """Whole periods of the counter in the clocks' offsets (m,) from the time mark, towards the past [ns].

    Modelled: the mark stands on a tick of true time.
    """
    return np.floor(clock_s * COUNTER_HZ) * (1e9 / COUNTER_HZ)


def receivers_part(
    templates: FrameTemplates,
    seen: Observations,
    sky: SkyState,
    clock_s: NDArray,
    clock_domain: I64,
    state: I64,
    almanac_satellites: Ints,
) -> Part:
    """For each receiver its channels and its closing frames: what block 2 of RU 2706636 C1 puts out.

    A channel with a value that the bus cannot carry (a range rate of 14 km/s) is left out whole, and not
    counted in STATUS.
    """
    channels, fits = templates.channel.fill(len(seen.row), channel_values(seen, sky, seen.row))
    whole = fits.all(axis=1)
    receiver = seen.receiver
    if not whole.all():
        channels, receiver = channels[whole], receiver[whole]
    m, k = templates.channel_id.shape
    tracking = np.bincount(receiver, minlength=m)
    closing, _ = templates.closing.fill(
        m,
        {
            "tag_offset_ns": tag_offset_ns(clock_s),
            "clock_domain": clock_domain,
            "frames": k * tracking + 1,
            "channels_tracking": tracking,
            "state": state,
            "almanac_satellites": almanac_satellites,
        },
    )
    place = np.concatenate((np.repeat(2 * receiver, k), np.repeat(2 * np.arange(m) + 1, len(_CLOSING))))
    order = np.argsort(place, kind="stable")
    can_id = np.concatenate((templates.channel_id[receiver].reshape(-1), templates.closing_id.reshape(-1)))
    data = np.concatenate((channels.reshape(-1, WIDTH), closing.reshape(-1, WIDTH)))
    return Part(can_id[order], data[order])


def channel_values(seen: Observations, sky: SkyState, satellite) -> dict:
    """Signals of the measurement frames by name; `satellite` picks (p,) from the arrays of the sky."""
    pos, vel = seen.pos_ecef_m.T, seen.vel_ecef_mps.T
    return {
        "channel": seen.channel,
        "signal": seen.signal,
        "pseudorange_m": seen.pseudorange_m,
        "range_rate_mps": seen.range_rate_mps,
        "cn0_dbhz": np.minimum(seen.cn0_dbhz, CN0_TOP_DBHZ),
        "lock": FULL,
        "phase_cyc": seen.phase_cyc,
        "slips": seen.slips,
        "half_cycle": seen.half_cycle,
        "x_m": pos[0], "y_m": pos[1], "z_m": pos[2],
        "frequency": sky.broadcast.frequency[satellite],
        "health": ~sky.broadcast.healthy[satellite],
        "vx_mps": vel[0], "vy_mps": vel[1], "vz_mps": vel[2],
        "clock_drift_mps": seen.clock_drift_mps,
        "iod": sky.broadcast.iod[satellite],
        "sat_system": satellites.system_of(seen.sat),
        "sat_number": satellites.number_of(seen.sat),
        "clock_m": seen.clock_m,
        "ura": sky.broadcast.ura[satellite],
    }  # fmt: skip


def almanac_part(templates: FrameTemplates, sat: I64, receiver: I64, predicted: Predictions) -> Part:
    """Predictions of satellites (p,), three frames each, from receivers (p,) (0-based)."""
    return _part(templates.almanac, templates.almanac_id[receiver], almanac_values(sat, predicted))


def almanac_values(sat: I64, predicted: Predictions) -> dict:
    """Signals of the almanac's frames by name, (p,) each."""
    pos, vel = predicted.pos_ecef_m.T, predicted.vel_ecef_mps.T
    return {
        "sat_system": satellites.system_of(sat),
        "sat_number": satellites.number_of(sat),
        "x_m": pos[0], "y_m": pos[1], "z_m": pos[2],
        "vx_mps": vel[0], "vy_mps": vel[1], "vz_mps": vel[2],
        "health": ~predicted.healthy,
        "age_h": np.minimum(np.floor(predicted.age_h), AGE_TOP_H),
    }  # fmt: skip


def block(parts: Sequence[Part], t_ns: int) -> FrameBatch:
    """The parts as one batch of unprotected frames, stamped with the time mark."""
    can_id = np.concatenate([part.can_id for part in parts])
    data = np.concatenate([part.data for part in parts])
    return FrameBatch(np.full(len(can_id), t_ns), can_id, np.full(len(can_id), WIDTH, np.uint8), data)
