"""The navigation block: fix, commands and heartbeat as frames, in the contract's order."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from functools import cache, lru_cache
from math import sqrt

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, U8, U32, Bool
from gnss_hil.dbc.common.satellites import NUMBERS
from gnss_hil.dbc.contract.batch_codec import Form, form
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import WIDTH, FrameBatch, batch, concat
from gnss_hil.dbc.contract.messages import FLIGHT_NODE, values_of
from gnss_hil.dbc.contract.values import raw_of
from gnss_hil.flightsw.records.commands import Commands
from gnss_hil.flightsw.records.ranges import Ranges, distinct
from gnss_hil.flightsw.records.solution import Fix, FixMode, NoFix, Solution, Tested

_NODE_STATE = raw_of("NodeState")

REFUSALS = values_of("NAV_REFUSED", "slot")
"""So many kinds of refusal are told of an epoch."""


class NodeState(IntEnum):
    """As in the contract's value table."""

    INIT = _NODE_STATE["INIT"]
    READY = _NODE_STATE["READY"]
    RUNNING = _NODE_STATE["RUNNING"]
    DEGRADED = _NODE_STATE["DEGRADED"]
    STOPPING = _NODE_STATE["STOPPING"]


@dataclass(frozen=True, slots=True)
class Standing:
    """How the flight software flies, as NAV_STATE has it.

    mode              raw value of the contract's table "FlightMode"
    silent_receivers  bit r: receiver r, 0-based, was heard before and closed nothing in this epoch
    without_fix       epochs; saturates as a frame
    """

    mode: int
    without_time: bool
    without_attitude: bool
    attitude_held: bool
    unheeded: bool
    silent_receivers: int
    without_fix: int

    @property
    def values(self) -> list[float]:
        return [
            self.mode, self.without_time, self.without_attitude, self.attitude_held, self.unheeded,
            self.silent_receivers, self.without_fix,
        ]  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Page:
    """A form with the identifiers and lengths (k,) of its frames."""

    form: Form
    can_id: U32
    length: U8

    def frames(self, values: list[float], t_ns: int) -> FrameBatch:
        """From the values of one frame after another; what does not fit saturates."""
        payloads, _ = self.form.write(np.array(values, float)[:, None])
        return FrameBatch(np.full(len(self.can_id), t_ns), self.can_id, self.length, payloads[0])


@cache
def _page(
    codec: Codec,
    mode: FixMode,
    items: int,
    receivers: int,
    with_velocity: bool = False,
    with_clock: bool = False,
) -> Page:
    """Navigation of a fix with so many clock items, and the heartbeat; with what the navigator states of the
    uncertainty of velocity and of clocks."""
    moving = mode is FixMode.POSITION_VELOCITY
    kinds = ["NAV_STATUS"]
    if mode is not FixMode.NO_FIX:
        kinds += [f"NAV_{v}{axis}" for v in ("", "V")[: 1 + moving] for axis in "XYZ"]
        kinds += ["NAV_CLOCK"] * items + ["NAV_DRIFT"] * (items * moving) + ["NAV_SIGMA", "NAV_CORR"]
        kinds += ["NAV_USED"] * receivers
        kinds += ["NAV_VSIGMA", "NAV_VCORR"] * with_velocity + ["NAV_CLOCK_SIGMA"] * (items * with_clock)
    kinds.append("NAV_STATE")
    can_id = [codec.can_id_of[kind, 0] for kind in kinds] + [codec.can_id_of["HEARTBEAT", FLIGHT_NODE]]
    kinds.append("HEARTBEAT")
    return Page(form(codec, kinds), np.array(can_id, np.uint32), np.full(len(kinds), WIDTH, np.uint8))


def _used(m: Ranges, fix: Fix, receivers: int) -> tuple[int, ...]:
    """receiver, channel mask, ... of every receiver."""
    return _masks(m.receiver[fix.used].tobytes(), m.channels[fix.used].tobytes(), receivers)


@lru_cache(maxsize=64)
def _masks(receivers_used: bytes, channels_used: bytes, receivers: int) -> tuple[int, ...]:
    """Most epochs use the same channels as the one before."""
    masks = [0] * receivers
    receiver, channels = (np.frombuffer(used, np.int64).tolist() for used in (receivers_used, channels_used))
    for number, channel in zip(receiver, channels, strict=True):
        masks[number] |= channel
    return tuple(value for number, mask in enumerate(masks, 1) for value in (number, mask))


def _left_out(receiver: I64, used: Bool) -> int:
    """How many receivers have no range in the fix, of those that have any."""
    return 0 if used.all() else distinct(receiver) - distinct(receiver[used])


def _pairs(items: tuple[int, ...], values: F64 | None) -> list[float]:
    """item, value, ... of every clock."""
    if values is None:
        return []
    return [v for pair in zip(items, values.tolist(), strict=True) for v in pair]


def _spread(covariance: F64 | None) -> list[float]:
    """Deviations of x, y, z, and correlations xy, xz, yz."""
    if covariance is None:
        return []
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = covariance.tolist()
    x, y, z = sqrt(xx), sqrt(yy), sqrt(zz)
    return [x, y, z, xy / (x * y), xz / (x * z), yz / (y * z)]


def _clock_sigmas(fix: Fix) -> list[float]:
    """item, deviation of its bias, of its drift, ... of every clock."""
    if fix.clock_variance_m2 is None:
        return []
    bias = np.sqrt(fix.clock_variance_m2).tolist()
    drift = [0.0] * len(bias)
    if fix.drift_variance_m2ps2 is not None:
        drift = np.sqrt(fix.drift_variance_m2ps2).tolist()
    return [v for row in zip(fix.items, bias, drift, strict=True) for v in row]


def _fix_values(m: Ranges, fix: Fix, mode: FixMode, receivers: int) -> list[float]:
    used = _used(m, fix, receivers)
    assert fix.pdop is not None, "estimation.dilution has seen to it"
    velocity = [] if fix.velocity_mps is None else fix.velocity_mps.tolist()
    return [
        mode, NoFix.FIX, fix.satellites, sum(mask.bit_count() for mask in used[1::2]), fix.pdop,
        fix.tested, m.satellites - fix.satellites, _left_out(m.receiver, fix.used),
        *fix.position_m.tolist(), *velocity,
        *_pairs(fix.items, fix.clock_m), *_pairs(fix.items, fix.drift_mps),
        *_spread(fix.covariance_m2), *used, *_spread(fix.velocity_covariance_m2ps2), *_clock_sigmas(fix),
    ]  # fmt: skip


def _command_frames(codec: Codec, commands: Commands, t_ns: int) -> FrameBatch:
    can_id = codec.can_id_of["COMMAND", 1] + commands.antenna
    data = codec.encode(
        "COMMAND",
        {
            "channel": commands.channel,
            "action": commands.action,
            "sat_system": commands.sat // NUMBERS,
            "sat_number": commands.sat % NUMBERS,
            "signal": commands.signal,
            "transaction": commands.transaction,
        },
    )
    return batch(can_id, data, t_ns=t_ns)


def heartbeat(codec: Codec, state: NodeState, boot_count: int, t_ns: int) -> FrameBatch:
    values = {"state": state, "boot_count": boot_count, "contract_hash": codec.hash}
    data = codec.encode("HEARTBEAT", {name: np.array(value) for name, value in values.items()})
    return batch(codec.can_id_of["HEARTBEAT", FLIGHT_NODE], data, t_ns=t_ns)


def encode(
    codec: Codec,
    boot_count: int,
    m: Ranges | None,
    solution: Solution,
    commands: Commands | None,
    node_state: NodeState,
    standing: Standing,
    refused: I64 | None,
    t_ns: int,
) -> FrameBatch:
    """Navigation, commands, heartbeat; unprotected yet.

    m         ranges offered to the navigator; None where there are none, and hence no fix
    refused   (reasons, identifiers) how often in this epoch; None: never
    """
    fix = solution.fix
    if fix is None or m is None:
        page = _page(codec, FixMode.NO_FIX, 0, 0)
        values = [FixMode.NO_FIX, solution.reason, 0, 0, 0.0, Tested.UNTESTED, 0, 0]
    else:
        page = _page(
            codec,
            solution.mode,
            len(fix.items),
            codec.receivers,
            fix.velocity_covariance_m2ps2 is not None,
            fix.clock_variance_m2 is not None,
        )
        values = _fix_values(m, fix, solution.mode, codec.receivers)
    frames = page.frames([*values, *standing.values, node_state, boot_count, codec.hash], t_ns)
    more = [] if refused is None else [_refusals(codec, refused, t_ns)]
    if commands is not None and len(commands):
        more.append(_command_frames(codec, commands, t_ns))
    return concat([frames[:-1], *more, frames[-1:]]) if more else frames


def _refusals(codec: Codec, refused: I64, t_ns: int) -> FrameBatch:
    """The most frequent of what was refused."""
    reason, identifier = refused.nonzero()
    count = refused[reason, identifier]
    most = np.argsort(-count, kind="stable")[:REFUSALS]
    values = {
        "slot": np.arange(len(most)),
        "reason": reason[most],
        "identifier": identifier[most],
        "count": np.minimum(count[most], values_of("NAV_REFUSED", "count") - 1),
    }
    can_id = np.full(len(most), codec.can_id_of["NAV_REFUSED", 0], np.uint32)
    return batch(can_id, codec.encode("NAV_REFUSED", values), t_ns=t_ns)
