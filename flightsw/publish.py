"""The navigation block: fix, commands and heartbeat as frames, in the contract's order."""

from __future__ import annotations

from enum import IntEnum
from functools import cache

import numpy as np

from dbc.codec import Codec
from dbc.contract import FLIGHT_NODE
from dbc.frames import FrameBatch, batch, concat
from dbc.satellites import NUMBERS
from flightsw.commander import Commands, signal_of
from flightsw.epoch import Measurements
from flightsw.position import Fix, NoFix
from flightsw.wire import Sheet, sheet

MODE_NONE, MODE_POSITION_VELOCITY = 0, 2


class NodeState(IntEnum):
    """As in the contract's value table."""

    INIT = 0
    READY = 1
    RUNNING = 2
    DEGRADED = 3


def _frames(page: Sheet, values: list[float], t_ns: int) -> FrameBatch:
    return FrameBatch(np.full(len(page.can_id), t_ns), page.can_id, page.length, page.write(values))


@cache
def _heartbeat_sheet(codec: Codec) -> Sheet:
    return sheet(codec, [("HEARTBEAT", FLIGHT_NODE)])


@cache
def _sheet(codec: Codec, items: int, receivers: int) -> Sheet:
    """Navigation of a fix with so many clock items, none meaning no fix, and the heartbeat."""
    kinds = ["NAV_STATUS"]
    if items:
        kinds += [f"NAV_{v}{axis}" for v in ("", "V") for axis in "XYZ"]
        kinds += ["NAV_CLOCK"] * items + ["NAV_DRIFT"] * items + ["NAV_SIGMA", "NAV_CORR"]
        kinds += ["NAV_USED"] * receivers
    return sheet(codec, [(kind, 0) for kind in kinds] + [("HEARTBEAT", FLIGHT_NODE)])


def _used(m: Measurements, fix: Fix, receivers: int) -> list[int]:
    """receiver, channel mask, ... of every receiver."""
    masks = [0] * receivers
    for receiver, channel in zip(m.receiver[fix.used].tolist(), m.channel[fix.used].tolist(), strict=True):
        masks[receiver] |= 1 << channel
    return [value for number, mask in enumerate(masks, 1) for value in (number, mask)]


def _fix_values(m: Measurements, fix: Fix, receivers: int) -> list[float]:
    sigma = np.sqrt(np.diagonal(fix.covariance_m2)).tolist()
    (_, xy, xz), (_, _, yz), _ = fix.covariance_m2.tolist()
    pairs = lambda rates: [v for pair in zip(fix.items, rates.tolist(), strict=True) for v in pair]  # noqa: E731
    return [
        MODE_POSITION_VELOCITY, NoFix.FIX, fix.satellites, int(fix.used.sum()), fix.pdop,
        *fix.position_m.tolist(), *fix.velocity_mps.tolist(), *pairs(fix.clock_m), *pairs(fix.drift_mps),
        *sigma, xy / (sigma[0] * sigma[1]), xz / (sigma[0] * sigma[2]), yz / (sigma[1] * sigma[2]),
        *_used(m, fix, receivers),
    ]  # fmt: skip


def _command_frames(codec: Codec, commands: Commands, t_ns: int) -> FrameBatch:
    can_id = codec.can_id_of["COMMAND", 1] + commands.antenna
    system = commands.sat // NUMBERS
    data = codec.encode(
        "COMMAND",
        {
            "channel": commands.channel,
            "action": commands.action,
            "sat_system": system,
            "sat_number": commands.sat % NUMBERS,
            "signal": signal_of(commands.sat),
            "transaction": commands.transaction,
        },
    )
    return batch(can_id, data, t_ns=t_ns)


def heartbeat(codec: Codec, state: NodeState, boot_count: int, t_ns: int) -> FrameBatch:
    return _frames(_heartbeat_sheet(codec), [state, boot_count, codec.hash], t_ns)


def block(
    codec: Codec,
    receivers: int,
    boot_count: int,
    m: Measurements,
    fix: Fix | NoFix,
    commands: Commands | None,
    t_ns: int,
) -> FrameBatch:
    """Navigation, commands, heartbeat; unprotected yet. `m` are the measurements offered to the fix."""
    if isinstance(fix, NoFix):
        page = _sheet(codec, 0, 0)
        values = [MODE_NONE, fix, 0, 0, 0.0, NodeState.DEGRADED]
    else:
        page = _sheet(codec, len(fix.items), receivers)
        values = [*_fix_values(m, fix, receivers), NodeState.RUNNING]
    frames = _frames(page, [*values, boot_count, codec.hash], t_ns)
    if commands is None or not len(commands):
        return frames
    return concat([frames[:-1], _command_frames(codec, commands, t_ns), frames[-1:]])
