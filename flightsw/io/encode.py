"""The navigation block: fix, commands and heartbeat as frames, in the contract's order."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from functools import cache

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.satellites import NUMBERS
from gnss_hil.dbc.contract.batch_codec import Form, form
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import WIDTH, FrameBatch, batch, concat
from gnss_hil.dbc.contract.messages import FLIGHT_NODE
from gnss_hil.flightsw.estimation.position import Fix, NoFix
from gnss_hil.flightsw.measurement.observables import Ranges
from gnss_hil.flightsw.measurement.signals import commanded_signal
from gnss_hil.flightsw.receivers.channel_manager import Commands

MODE_NONE, MODE_POSITION, MODE_POSITION_VELOCITY = 0, 1, 2


class NodeState(IntEnum):
    """As in the contract's value table."""

    INIT = 0
    READY = 1
    RUNNING = 2
    DEGRADED = 3


@dataclass(frozen=True, slots=True, eq=False)
class Page:
    """A form with the identifiers and lengths (k,) of its frames."""

    form: Form
    can_id: NDArray[np.uint32]
    length: NDArray[np.uint8]

    def frames(self, values: list[float], t_ns: int) -> FrameBatch:
        """From the values of one frame after another; what does not fit saturates."""
        payloads, _ = self.form.write(np.array(values, float)[:, None])
        return FrameBatch(np.full(len(self.can_id), t_ns), self.can_id, self.length, payloads[0])


@cache
def _page(codec: Codec, mode: int, items: int, receivers: int) -> Page:
    """Navigation of a fix with so many clock items, and the heartbeat."""
    moving = mode == MODE_POSITION_VELOCITY
    kinds = ["NAV_STATUS"]
    if mode != MODE_NONE:
        kinds += [f"NAV_{v}{axis}" for v in ("", "V")[: 1 + moving] for axis in "XYZ"]
        kinds += ["NAV_CLOCK"] * items + ["NAV_DRIFT"] * (items * moving) + ["NAV_SIGMA", "NAV_CORR"]
        kinds += ["NAV_USED"] * receivers
    can_id = [codec.can_id_of[kind, 0] for kind in kinds] + [codec.can_id_of["HEARTBEAT", FLIGHT_NODE]]
    kinds.append("HEARTBEAT")
    return Page(form(codec, kinds), np.array(can_id, np.uint32), np.full(len(kinds), WIDTH, np.uint8))


def _used(m: Ranges, fix: Fix, receivers: int) -> list[int]:
    """receiver, channel mask, ... of every receiver."""
    masks = [0] * receivers
    for receiver, channels in zip(m.receiver[fix.used].tolist(), m.channels[fix.used].tolist(), strict=True):
        masks[receiver] |= channels
    return [value for number, mask in enumerate(masks, 1) for value in (number, mask)]


def _fix_values(m: Ranges, fix: Fix, mode: int, receivers: int) -> list[float]:
    sigma = np.sqrt(np.diagonal(fix.covariance_m2)).tolist()
    (_, xy, xz), (_, _, yz), _ = fix.covariance_m2.tolist()
    pairs = lambda rates: [v for pair in zip(fix.items, rates.tolist(), strict=True) for v in pair]  # noqa: E731
    moving = mode == MODE_POSITION_VELOCITY
    used = _used(m, fix, receivers)
    return [
        mode, NoFix.FIX, fix.satellites, sum(mask.bit_count() for mask in used[1::2]), fix.pdop,
        *fix.position_m.tolist(), *(fix.velocity_mps.tolist() if moving else ()),
        *pairs(fix.clock_m), *(pairs(fix.drift_mps) if moving else ()),
        *sigma, xy / (sigma[0] * sigma[1]), xz / (sigma[0] * sigma[2]), yz / (sigma[1] * sigma[2]),
        *used,
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
            "signal": commanded_signal(commands.sat),
            "transaction": commands.transaction,
        },
    )
    return batch(can_id, data, t_ns=t_ns)


def heartbeat(codec: Codec, state: NodeState, boot_count: int, t_ns: int) -> FrameBatch:
    data = codec.encode("HEARTBEAT", {"state": state, "boot_count": boot_count, "contract_hash": codec.hash})
    return batch(codec.can_id_of["HEARTBEAT", FLIGHT_NODE], data, t_ns=t_ns)


def block(
    codec: Codec,
    receivers: int,
    boot_count: int,
    m: Ranges | None,
    fix: Fix | NoFix,
    commands: Commands | None,
    t_ns: int,
) -> FrameBatch:
    """Navigation, commands, heartbeat; unprotected yet. `m` are the ranges offered to the fix; None where
    there is nothing to offer."""
    if isinstance(fix, NoFix):
        page = _page(codec, MODE_NONE, 0, 0)
        values = [MODE_NONE, fix, 0, 0, 0.0, NodeState.DEGRADED]
    else:
        mode = MODE_POSITION if fix.velocity_mps is None else MODE_POSITION_VELOCITY
        page = _page(codec, mode, len(fix.items), receivers)
        values = [*_fix_values(m, fix, mode, receivers), NodeState.RUNNING]
    frames = page.frames([*values, boot_count, codec.hash], t_ns)
    if commands is None or not len(commands):
        return frames
    return concat([frames[:-1], _command_frames(codec, commands, t_ns), frames[-1:]])
