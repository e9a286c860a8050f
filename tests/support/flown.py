"""A bus with fake receivers for the flight software's tests: blocks of frames from synthetic measurements.

The receivers do what they are told at once (or after `delay` epochs), and when told nothing all track the
satellites nearest the zenith.
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.contract import e2e, screening
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import EMPTY, batch, concat
from tests.support import synthetic_epochs as s

CODEC = codec(4)
AUTO, IDLE = -2, -1


def frames(kind, values, number=0):
    return batch(CODEC.can_id_of[kind, number], CODEC.encode(kind, values))


def mark_frames(epoch, t_ns, session=7, clock=0):
    week, second, ns = gpstime.week_second_ns(t_ns)
    return [
        frames("TIME_MARK", {"session": session, "epoch": epoch}),
        frames("TIME_GPS", {"week": week, "second": second}),
        frames("TIME_FINE", {"nanosecond": ns, "leap": 16, "mark_clock": clock}),
    ]


def attitude_frames(craft, t):
    q = s.quaternion(craft.dcm_eci(t) @ s.ecef_from_eci(t).T)
    return [
        frames("ATT_Q01", {"q0": q[0], "q1": q[1]}),
        frames("ATT_Q23", {"q2": q[2], "q3": q[3]}),
        frames("ATT_RATE", dict(zip(("wx_rps", "wy_rps", "wz_rps"), craft.rate_body, strict=True))),
    ]


def channel_frames(receiver, channel, o, k, cn0=45.0, lock=5, health=0, ura=0, signal=0, frequency=0):
    """The ten frames of one channel from row k of `synthetic.observe`."""
    values = {
        "RANGE": {"pseudorange_m": o["p"][k]},
        "RATE": {"signal": signal, "range_rate_mps": o["pdot"][k], "cn0_dbhz": cn0, "lock": lock},
        "PHASE": {},
        "SV_X": {"x_m": o["x"][k]},
        "SV_Y": {"y_m": o["y"][k]},
        "SV_Z": {"z_m": o["z"][k], "health": health},
        "SV_VX": {"vx_mps": o["vx"][k], "clock_drift_mps": o["drift"][k]},
        "SV_VY": {"vy_mps": o["vy"][k]},
        "SV_VZ": {"vz_mps": o["vz"][k], "frequency": frequency, "ura": ura},
        "SV_CLOCK": {
            "sat_system": int(o["sat"][k]) // 64, "sat_number": int(o["sat"][k]) % 64,
            "clock_m": o["clock"][k],
        },
    }  # fmt: skip
    return [frames(kind, {"channel": channel, **v}, receiver) for kind, v in values.items()]


def almanac_frames(receiver, sky, t, sats):
    parts = []
    for sat in sats:
        to_ecef = s.ecef_from_eci(t)
        r = to_ecef @ sky[sat].at(t)
        v = to_ecef @ (sky[sat].velocity(t) - np.cross([0, 0, s.W], sky[sat].at(t)))
        who = {"sat_system": sat // 64, "sat_number": sat % 64}
        parts += [
            frames("ALM_XY", {**who, "x_m": r[0], "y_m": r[1]}, receiver),
            frames("ALM_Z", {**who, "z_m": r[2]}, receiver),
            frames("ALM_V", {**who, "vx_mps": v[0], "vy_mps": v[1], "vz_mps": v[2]}, receiver),
        ]
    return parts


class FakeBus:
    """Receivers of `channels` channels each, on `craft`'s antennas."""

    def __init__(self, craft, sky, channels=6, delay=1, session=7, almanac=True, nodes=(), mark_clock=0):
        self.mark_clock = mark_clock
        self.craft, self.sky, self.delay, self.session, self.almanac = craft, sky, delay, session, almanac
        self.nodes = nodes  # others that send heartbeats
        antennas = len(craft.domain)
        self.shape = antennas, channels
        self.doing = np.full(self.shape, AUTO)
        self.since = np.zeros(self.shape, int)
        self.counters = e2e.fresh_counters(CODEC)
        self.heard = e2e.fresh_counters(CODEC)
        self.answers = []
        self.measured = []
        self.boots = [1] * antennas
        self.commands = []  # (epoch, receiver, channel, action, sat)

    def obey(self, inbox, epoch):
        screened = screening.screen(CODEC, inbox, self.heard)
        self.heard = screened.counters
        rows = screened.frames
        rows = rows[CODEC.kind_of[rows.can_id] == CODEC.kinds["COMMAND"].number]
        self.answers = []
        if not len(rows):
            return
        v = CODEC.decode("COMMAND", rows.data)
        for i, receiver in enumerate(CODEC.number_of[rows.can_id].tolist()):
            channel, action = int(v["channel"][i]), int(v["action"][i])
            sat = int(64 * v["sat_system"][i] + v["sat_number"][i])
            doing = {0: IDLE, 1: sat, 2: AUTO}[action]
            self.commands.append((epoch, receiver, channel, action, sat))
            if (receiver, channel, doing) not in self.measured:
                self.since[receiver - 1, channel] = epoch
            self.doing[receiver - 1, channel] = doing
            echo = {k: v[k][i] for k in ("channel", "sat_system", "sat_number", "transaction")}
            self.answers.append(frames("ACK", {**echo, "result": 0}, receiver))

    def tracking(self, t, epoch):
        """(receiver, channel, satellite) that measure now."""
        craft, sky = self.craft, self.sky
        at = craft.orbit.at(t)
        seen = [sat for sat in sky if s.clear(at, sky[sat].at(t))]
        seen.sort(key=lambda sat: -(sky[sat].at(t) - at) @ at / np.linalg.norm(sky[sat].at(t) - at))
        found = []
        for (a, c), doing in np.ndenumerate(self.doing):
            if doing == AUTO and c < len(seen):
                found.append((a + 1, c, seen[c]))
            elif doing >= 0 and doing in seen and epoch - self.since[a, c] >= self.delay:
                found.append((a + 1, c, int(doing)))
        return found

    def deliver(self, receiver, channel, o, k):
        """What a receiver says of a satellite it tracks."""
        return channel_frames(receiver, channel, o, k)

    def block(self, epoch, inbox=EMPTY, t=None):
        """The protected block of an epoch after obeying the flight software's frames. The mark says t; all
        latch when the clock that shows the mark does."""
        t = float(epoch) if t is None else t
        self.obey(inbox, epoch)
        mark = mark_frames(epoch, s.T0_NS + round(t * 1e9), self.session, self.mark_clock)
        if self.mark_clock:
            t = s.shown(self.craft, self.mark_clock - 1, t)
        parts = [*mark, *self.answers]
        parts += attitude_frames(self.craft, t)
        rows = self.measured = self.tracking(t, epoch)
        o = s.observe(self.craft, [(r - 1, sat) for r, _, sat in rows], self.sky, t)
        for k, (receiver, channel, _) in enumerate(rows):
            parts += self.deliver(receiver, channel, o, k)
        for receiver in range(1, self.shape[0] + 1):
            mine = sum(r == receiver for r, _, _ in rows)
            domain = int(self.craft.domain[receiver - 1])
            parts.append(frames("TAG", {"clock_domain": domain}, receiver))
            parts.append(frames("STATUS", {"frames": 10 * mine + 1, "channels_tracking": mine}, receiver))
        if self.almanac:
            parts += almanac_frames(1, self.sky, t, list(self.sky)[epoch % 4 :: 4])
        for node, boot in [*enumerate(self.boots, 1), *((node, 1) for node in self.nodes)]:
            beat = {"state": 2, "boot_count": boot, "contract_hash": CODEC.hash}
            parts.append(frames("HEARTBEAT", beat, node))
        out, self.counters = e2e.protect(CODEC, concat(parts), self.counters, epoch)
        return out


def decoded(block, kind):
    """Signals of all frames of a kind in a block: name -> (n,)."""
    rows = block[CODEC.kind_of[block.can_id & 0x7FF] == CODEC.kinds[kind].number]
    return CODEC.decode(kind, rows.data)


def position_of(block):
    return np.array([decoded(block, f"NAV_{axis}")[f"{axis.lower()}_m"][0] for axis in "XYZ"])
