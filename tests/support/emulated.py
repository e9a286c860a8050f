"""A soyuz on the nominal sky, stepped by hand."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from gnss_hil.dbc.common import satellites, vehicle
from gnss_hil.dbc.contract import e2e, frames
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.emulator import assemble
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.environment.block import SkyCache
from gnss_hil.emulator.step import emulate_step

CODEC = codec(4)
VEHICLE = vehicle.load(vehicle.find("soyuz-ms"))
QUIET = {"code_noise": False, "carrier_noise": False, "doppler_noise": False}
QUICK = {"hot_s": 0, "warm_s": 0, "cold_s": 0, "ephemeris_s": 0}


def craft(name="soyuz", **tables):
    return {
        "name": name,
        "vehicle": "soyuz-ms.toml",
        "orbit": {"altitude_km": 415, "inclination_deg": 51.6},
        **tables,
    }


def document(*crafts, seed=1, interval_s=1.0, **tables):
    return {
        "name": "test",
        "seed": seed,
        "time": {"start_gps": "2012-10-31T00:15:00", "duration_s": 600, "epoch_interval_s": interval_s},
        "craft": list(crafts) or [craft(receivers=QUICK, factors=QUIET)],
        **tables,
    }


def world(*crafts, session=7, **tables):
    given = scenario.parse(document(*crafts, **tables), "test")
    return assemble.build_world(given, [VEHICLE] * len(given.craft), session)


def run(the_world, epochs, orders=None, state=None, first=0):
    """Step through epochs; orders: epoch in which they act -> command frames. All states and results."""
    state = state or assemble.initial_state(the_world)
    names = [c.name for c in the_world.craft]
    states, blocks, truths = [], [], []
    for epoch in range(first, first + epochs):
        inbox = {name: (orders or {}).get(epoch, frames.EMPTY) for name in names}
        state, sent, truth = emulate_step(the_world, state, inbox, epoch)
        states.append(state)
        blocks.append(sent[names[0]])
        truths.append(truth[0])
    return states, blocks, truths


def epoch_at(the_world, epoch):
    """What is true for the first craft in an epoch, whatever its receivers do: satellites `sky`, `view` of
    them, `cn0_dbhz`, `signal`, `held`, `hidden` (m, n), `in_sight` (n,)."""
    prepared, k = the_world.craft[0].prepared(epoch)
    block, at = prepared.block, prepared.block.geometry

    def only(arrays):
        if isinstance(arrays, np.ndarray):
            return arrays[k]
        found = {name: getattr(arrays, name) for name in arrays.__slots__}
        return SimpleNamespace(**{n: v if n == "index" or v is None else only(v) for n, v in found.items()})

    return SimpleNamespace(
        sky=only(at.sky),
        view=only(at.view),
        cn0_dbhz=block.cn0_dbhz[k],
        in_sight=block.in_sight[k],
        signal=block.signal[k],
        held=None if block.held is None else block.held[k],
        hidden=block.hidden[k],
    )


def under(the_world, **changes):
    """The same world with another environment of its first craft, `sky` a sky; see `Environment`."""
    craft = the_world.craft[0]
    if "sky" in changes:
        changes["sky"] = SkyCache(changes["sky"])
    return replace(the_world, craft=(replace(craft, environment=replace(craft.environment, **changes)),))


def command(receiver, channel, action, sat=None, signal=None, transaction=0):
    """One unprotected command frame; `sat` a name such as G07."""
    index = satellites.parse(sat) if sat else 0
    system = int(satellites.system_of(index))
    values = {
        "channel": channel,
        "action": action,
        "sat_system": system,
        "sat_number": int(satellites.number_of(index)),
        "signal": system if signal is None else signal,  # L1CA 0 for GPS 0, L1OF 1 for GLONASS 1
        "transaction": transaction,
    }
    return frames.batch(CODEC.can_id_of["COMMAND", receiver], CODEC.encode("COMMAND", values))


RELEASE, TRACK, AUTONOMOUS = 0, 1, 2


def sealed(*batches, epoch=0, counters=None):
    counters = e2e.fresh_counters(CODEC) if counters is None else counters
    return e2e.protect(CODEC, frames.concat(batches), counters, epoch)[0]


def orders(by_epoch):
    """Command frames of several epochs, protected one after another as a sender does."""
    counters, out = e2e.fresh_counters(CODEC), {}
    for epoch, batches in by_epoch.items():
        out[epoch], counters = e2e.protect(CODEC, frames.concat(batches), counters, epoch - 1)
    return out


def decode(block, kind):
    """Signals of one kind in a block, by name, with the receiver number as `receiver`."""
    rows = CODEC.kind_of[block.can_id] == CODEC.kinds[kind].number
    found = CODEC.decode(kind, block.data[rows])
    found["receiver"] = CODEC.number_of[block.can_id[rows]].astype(int)
    return found


def channels(block):
    """One row for each channel that delivered: all signals of its ten frames."""
    out = {}
    for kind in ("RANGE", "RATE", "PHASE", "SV_X", "SV_Y", "SV_Z", "SV_VX", "SV_VY", "SV_VZ", "SV_CLOCK"):
        out.update(decode(block, kind))
    out["sat"] = satellites.index(out["sat_system"], out["sat_number"])
    return out


def answers(block):
    """(receiver, channel, result, transaction) of every ACK."""
    found = decode(block, "ACK")
    columns = (found[k].tolist() for k in ("receiver", "channel", "result", "transaction"))
    return list(zip(*columns, strict=True))


def tracked(block, receiver):
    """Satellite names by channel of one receiver."""
    found = channels(block)
    rows = np.flatnonzero(found["receiver"] == receiver)
    return {int(found["channel"][i]): satellites.name(found["sat"][i]) for i in rows}
