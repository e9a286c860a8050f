"""The bus contract as one table: every message, signal and identifier.

The DBC files, the interface document, the frame budget and the codec's tables are generated from here.
Tests hold the codec equal to what cantools reads from the DBC, so that what flies is what a third party sees.

A *kind* is one layout. A kind that repeats per receiver (or per node) has one identifier for each:
`base + stride * (number - 1)`. Payload signals are packed little-endian in the order listed, behind
the 16-bit protection header of AUTOSAR E2E Profile 11 (`gnss_hil.dbc.contract.e2e`): CRC, counter, epoch
modulo 16.

To add a message: a row of KINDS, among those of its purpose, and in NODES its node, if that is new; tables of
named values are in `values`. What is taken twice is refused when this module is imported (`allocation`). Low
identifiers go first on the bus. Free are:

    identifiers   0x001..0x00F, 0x013..0x01F, 0x028..0x02F, 0x038..0x03F, 0x051..0x05F, 0x180..0x3FF and
                  0x480..0x6FF; for sensors 0x063..0x0FF. Of one for each receiver the first, with stride
                  0x10: 0x10C..0x10D, 0x403..0x40F
    nodes         11..15, 17..207
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from gnss_hil.dbc.common.limits import MAX_RECEIVERS
from gnss_hil.dbc.contract.allocation import check
from gnss_hil.dbc.contract.layout import Kind, Signal, laid_out
from gnss_hil.dbc.contract.values import TIME_OFFSETS

BIT_RATE = 1_000_000

# Node numbers: they appear in the heartbeat's identifier and nowhere else.
ATTITUDE_NODE = 9
TIME_NODE = 10
FLIGHT_NODE = 16
NODES = {"ATT": ATTITUDE_NODE, "TIME": TIME_NODE, "FLIGHT": FLIGHT_NODE}
"""DBC node name -> node number, beside the receivers: RX1 is 1, and so on."""

HEARTBEAT_BASE = 0x700
"""A node's heartbeat has identifier HEARTBEAT_BASE + node number."""


def _u(name: str, bits: int, comment: str, unit: str = "", factor: float = 1, offset: float = 0) -> Signal:
    return Signal(name, bits, factor, offset, unit, comment=comment)


def _s(name: str, bits: int, factor: float, unit: str, comment: str) -> Signal:
    return Signal(name, bits, factor, 0, unit, signed=True, comment=comment)


def _enum(name: str, bits: int, table: str, comment: str) -> Signal:
    return Signal(name, bits, values=table, comment=comment)


HEADER = laid_out(
    (
        _u("e2e_crc", 8, "CRC-8 SAE J1850 over the data id (low, high byte) and bytes 1..7"),
        _u("e2e_counter", 4, "0..14 per protected stream; 15 is never sent"),
        _u("epoch_mod16", 4, "epoch number modulo 16: frames of different epochs never mix"),
    ),
    0,
)
HEADER_NAMES = frozenset(signal.name for signal in HEADER)

_CHANNEL = _u("channel", 5, "channel of the receiver, 0-based")
_SYSTEM = _enum("sat_system", 3, "SatSystem", "navigation satellite system")
_NUMBER = _u("sat_number", 6, "PRN or slot number, 1-based; 0 = none")
_SIGNAL = _enum("signal", 4, "Signal", "ranging signal")
_TRANSACTION = _u("transaction", 12, "transaction number of the command")

_BENCH = (
    _u("epoch", 16, "epoch number modulo 65536"),
    _u("session", 16, "run identifier, as in TIME_MARK"),
)

_POSITION = "ECEF WGS-84 of the transmission instant, antenna phase centre, not rotated for signal flight"


def _kind(name, base, sender, receivers, comment, *signals, **more) -> Kind:
    return Kind(name, base, sender, tuple(receivers), comment, HEADER + laid_out(signals, 16), **more)


def _nav(name, base, comment, *signals, **more) -> Kind:
    return _kind(name, base, "FLIGHT", ("TIME",), comment, *signals, **more)


def _measurement(name, offset, comment, *signals) -> Kind:
    return _kind(
        name, 0x100 + offset, "RX", ("FLIGHT",), comment, _CHANNEL, *signals,
        per="receiver", stride=0x10, key="channel",
    )  # fmt: skip


KINDS: tuple[Kind, ...] = (
    # --- time mark: the instant all receivers latch ---------------------------------------------------
    _kind("TIME_MARK", 0x010, "TIME", ("RX", "ATT", "FLIGHT"),
          "Opens an epoch. All receivers latch at this instant, each in its own clock.",
          _u("session", 16, "run identifier; a new one means the emulator restarted"),
          _u("epoch", 32, "epoch number, 0-based")),
    _kind("TIME_GPS", 0x011, "TIME", ("RX", "ATT", "FLIGHT"), "GPS time of the mark: week and second.",
          _u("week", 16, "full GPS week number", "week"),
          _u("second", 20, "second of week", "s")),
    _kind("TIME_FINE", 0x012, "TIME", ("RX", "ATT", "FLIGHT"), "GPS time of the mark: nanosecond, and UTC.",
          _u("nanosecond", 30, "nanosecond of second", "ns"),
          _u("leap", 8, "GPS - UTC", "s"),
          _enum("mark_clock", 4, "MarkClock", "the clock that showed the mark")),
    # --- commands and their answers -------------------------------------------------------------------
    _kind("COMMAND", 0x020, "FLIGHT", ("RX",), "Channel command; sent in epoch k it acts by epoch k+1.",
          _CHANNEL, _enum("action", 2, "Action", "what the channel shall do"), _SYSTEM, _NUMBER, _SIGNAL,
          _TRANSACTION, per="receiver", stride=1, key="channel", cycle="event"),
    _kind("ACK", 0x030, "RX", ("FLIGHT",), "Answer to a command, in the block of the next epoch.",
          _CHANNEL, _enum("result", 4, "AckResult", "accepted, or why not"), _SYSTEM, _NUMBER, _TRANSACTION,
          per="receiver", stride=1, key="channel", cycle="event"),
    # --- navigation: centre of mass, WGS-84 ECEF, at the time mark's GPS time -------------------------
    _nav("NAV_STATUS", 0x040, "Opens the navigation block of an epoch; sent whether or not there is a fix.",
         _enum("mode", 3, "NavMode", "what the block contains"),
         _enum("no_fix", 4, "NoFix", "why there is no fix"),
         _u("satellites", 7, "distinct satellites in the fix"),
         _u("measurements", 8, "pseudoranges in the fix"),
         _u("pdop", 16, "position dilution over the measurements used", "", 0.01),
         _enum("tested", 2, "Tested", "whether a range that is wrong would have been seen"),
         _u("excluded_satellites", 4, "satellites left out because they contradict the others"),
         _u("excluded_receivers", 4, "receivers left out because they contradict the others")),
    *(_nav(f"NAV_{axis.upper()}", 0x041 + i, f"Position {axis} of the centre of mass.",
           _s(f"{axis}_m", 41, 0.0001, "m", "centre of mass, ECEF WGS-84, at the time mark"))
      for i, axis in enumerate("xyz")),
    *(_nav(f"NAV_V{axis.upper()}", 0x044 + i, f"Velocity {axis} of the centre of mass.",
           _s(f"v{axis}_mps", 28, 0.0001, "m/s", "Earth-relative velocity in ECEF WGS-84"))
      for i, axis in enumerate("xyz")),
    _nav("NAV_CLOCK", 0x047, "One clock or system offset of the fix.",
         _enum("item", 4, "ClockItem", "which clock"),
         _s("bias_m", 41, 0.0001, "m",
            "; ".join(["receiver clock minus GPS time, times c"]
                      + [f"{of}_OFFSET: what {of} pseudoranges are longer" for of in TIME_OFFSETS.values()])),
         key="item"),
    _nav("NAV_DRIFT", 0x048, "Rate of one clock of the fix.",
         _enum("item", 4, "ClockItem", "which clock"),
         _s("drift_mps", 28, 0.0001, "m/s", "rate of the clock, times c"), key="item"),
    _nav("NAV_SIGMA", 0x049, "Standard deviations of the position.",
         *(_u(f"sigma_{axis}_m", 16, "1 sigma, saturates at the top", "m", 0.01) for axis in "xyz")),
    _nav("NAV_CORR", 0x04A, "Correlations of the position.",
         *(_s(f"rho_{pair}", 16, 0.0001, "", "correlation coefficient") for pair in ("xy", "xz", "yz"))),
    _nav("NAV_USED", 0x04B, "Channels of one receiver whose pseudoranges are in the fix.",
         _u("receiver", 4, "receiver number, 1-based"),
         _u("channels", 32, "bit k: channel k is in the fix"), key="receiver"),
    _nav("NAV_VSIGMA", 0x04C, "Standard deviations of the velocity; with NAV_VX.",
         *(_u(f"sigma_v{axis}_mps", 16, "1 sigma, saturates at the top", "m/s", 0.001) for axis in "xyz")),
    _nav("NAV_VCORR", 0x04D, "Correlations of the velocity; with NAV_VX.",
         *(_s(f"rho_v{pair}", 16, 0.0001, "", "correlation coefficient") for pair in ("xy", "xz", "yz"))),
    _nav("NAV_CLOCK_SIGMA", 0x04E, "Standard deviations of one clock of the fix and of its rate.",
         _enum("item", 4, "ClockItem", "which clock"),
         _u("sigma_bias_m", 24, "1 sigma, saturates at the top", "m", 0.001),
         _u("sigma_drift_mps", 20, "1 sigma, saturates at the top; nothing without NAV_DRIFT", "m/s", 0.0001),
         key="item"),
    _nav("NAV_STATE", 0x04F, "How the flight software flies, every epoch: its mode and what it does without.",
         _enum("mode", 4, "FlightMode", "mode"),
         _enum("without_time", 1, "Flag", "no time mark that can be believed"),
         _enum("without_attitude", 1, "Flag", "no attitude, reported or held"),
         _enum("attitude_held", 1, "Flag", "the last attitude, turned on by its rates"),
         _enum("unheeded", 1, "Flag", "commands that were repeated and not answered yet"),
         _u("silent_receivers", 8, "bit r - 1: receiver r was heard before and closed nothing in this epoch"),
         _u("without_fix", 16, "epochs since the last fix or the first time mark; saturates", "epoch")),
    _nav("NAV_REFUSED", 0x050, "What was refused in this epoch, and why: the eight most frequent.",
         _u("slot", 3, "0-based; the most frequent first"),
         _enum("reason", 6, "Refused", "why"),
         _u("identifier", 11, "of the frames; of what they say, of the frame that closes it"),
         _u("count", 12, "in this epoch; saturates"), key="slot", cycle="event"),
    # --- attitude -------------------------------------------------------------------------------------
    _kind("ATT_Q01", 0x060, "ATT", ("FLIGHT",), "Body from ECEF at the time mark: scalar and x.",
          *(_s(f"q{i}", 24, 1.25e-7, "", "Hamilton, passive: v_body = C(q) v_ecef") for i in (0, 1))),
    _kind("ATT_Q23", 0x061, "ATT", ("FLIGHT",), "Body from ECEF at the time mark: y and z.",
          *(_s(f"q{i}", 24, 1.25e-7, "", "Hamilton, passive: v_body = C(q) v_ecef") for i in (2, 3))),
    _kind("ATT_RATE", 0x062, "ATT", ("FLIGHT",), "Angular rate relative to inertial space, body axes.",
          *(_s(f"w{axis}_rps", 16, 4e-6, "rad/s", "body axes") for axis in "xyz")),
    # --- measurements: ten frames a tracked channel and epoch -----------------------------------------
    _measurement("RANGE", 0x0, "Pseudorange at the antenna's phase centre, raw clocks.",
                 _u("pseudorange_m", 42, "c (t_receive - t_transmit), raw clocks", "m", 0.0001)),
    _measurement("RATE", 0x1, "Range rate and quality of the channel.",
                 _SIGNAL,
                 _s("range_rate_mps", 28, 0.0001, "m/s", "dP/dt by GPS time at the latch"),
                 _u("cn0_dbhz", 8, "carrier to noise density", "dBHz", 0.25),
                 _enum("lock", 3, "Lock", "lock state")),
    _measurement("PHASE", 0x2, "Carrier phase.",
                 _s("phase_cyc", 38, 0.001, "cycle",
                    "RINEX sign: grows with range; restarts, with a slip, before it overflows"),
                 _u("slips", 4, "cycle slip counter modulo 16"),
                 _enum("half_cycle", 1, "Flag", "half-cycle ambiguity unresolved")),
    _measurement("SV_X", 0x3, "Satellite position x.", _s("x_m", 41, 0.0001, "m", _POSITION)),
    _measurement("SV_Y", 0x4, "Satellite position y.", _s("y_m", 41, 0.0001, "m", _POSITION)),
    _measurement("SV_Z", 0x5, "Satellite position z.", _s("z_m", 41, 0.0001, "m", _POSITION),
                 _enum("health", 1, "Health", "as broadcast")),
    _measurement("SV_VX", 0x6, "Satellite velocity x and clock drift.",
                 _s("vx_mps", 27, 0.0001, "m/s", "Earth-relative, ECEF of the transmission instant"),
                 _s("clock_drift_mps", 16, 2e-5, "m/s", "rate of clock_m")),
    _measurement("SV_VY", 0x7, "Satellite velocity y and issue of data.",
                 _s("vy_mps", 27, 0.0001, "m/s", "Earth-relative, ECEF of the transmission instant"),
                 _u("iod", 10, "issue of data (GPS IODE, GLONASS tb index)")),
    _measurement("SV_VZ", 0x8, "Satellite velocity z, frequency and accuracy.",
                 _s("vz_mps", 27, 0.0001, "m/s", "Earth-relative, ECEF of the transmission instant"),
                 _s("frequency", 5, 1, "", "GLONASS frequency number -7..+6; 0 otherwise"),
                 _s("ura", 5, 1, "", "user range accuracy index, IS-GPS-200 20.3.3.3.1.3 and 30.3.3.1.1.4")),
    _measurement("SV_CLOCK", 0x9, "Which satellite the channel tracks, and its clock. Closes the channel.",
                 _SYSTEM, _NUMBER,
                 _s("clock_m", 34, 0.0001, "m",
                    "add to the pseudorange; relativity and group delay inside")),
    _kind("IONO_ALPHA", 0x10A, "RX", ("FLIGHT",),
          "Ionosphere as the satellites describe it; only where there is one. Amplitude, in s.",
          *(_s(f"alpha{k}", 8, 2.0**power, f"s/semicircle^{k}", "IS-GPS-200 20.3.3.5.1.7")
            for k, power in enumerate((-30, -27, -24, -24))),
          per="receiver", stride=0x10),
    _kind("IONO_BETA", 0x10B, "RX", ("FLIGHT",), "The same: period, in s.",
          *(_s(f"beta{k}", 8, 2.0**power, f"s/semicircle^{k}", "IS-GPS-200 20.3.3.5.1.7")
            for k, power in enumerate((11, 14, 16, 16))),
          per="receiver", stride=0x10),
    _kind("TAG", 0x10E, "RX", ("FLIGHT",), "The receiver's own time tag of the latch.",
          _s("tag_offset_ns", 36, 1, "ns", "receiver's clock minus time mark by its counter; diagnostic"),
          _u("clock_domain", 3, "receivers with the same number share an oscillator"),
          per="receiver", stride=0x10),
    _kind("STATUS", 0x10F, "RX", ("FLIGHT",), "Closes the receiver's epoch.",
          _u("frames", 10, "measurement frames sent this epoch, tag included"),
          _u("channels_tracking", 6, "channels with measurements this epoch"),
          _enum("state", 3, "ReceiverState", "receiver state"),
          _u("almanac_satellites", 8, "satellites in the almanac"),
          per="receiver", stride=0x10),
    # --- bulk: almanac predictions --------------------------------------------------------------------
    _kind("ALM_XY", 0x400, "RX", ("FLIGHT",), "Almanac prediction for the time mark: x, y.",
          _SYSTEM, _NUMBER, _s("x_m", 19, 250, "m", "ECEF WGS-84"), _s("y_m", 19, 250, "m", "ECEF WGS-84"),
          per="receiver", stride=0x10, cycle="bulk"),
    _kind("ALM_Z", 0x401, "RX", ("FLIGHT",), "Almanac prediction for the time mark: z, health, age.",
          _SYSTEM, _NUMBER, _s("z_m", 19, 250, "m", "ECEF WGS-84"),
          _enum("health", 1, "Health", "as broadcast"), _u("age_h", 8, "age of the almanac", "h"),
          per="receiver", stride=0x10, cycle="bulk"),
    _kind("ALM_V", 0x402, "RX", ("FLIGHT",),
          "Almanac prediction for the time mark: velocity; closes the three.",
          _SYSTEM, _NUMBER,
          *(_s(f"v{axis}_mps", 13, 1, "m/s", "Earth-relative, ECEF") for axis in "xyz"),
          per="receiver", stride=0x10, cycle="bulk"),
    # --- heartbeats -----------------------------------------------------------------------------------
    _kind("HEARTBEAT", HEARTBEAT_BASE + 1, "NODE", ("TIME", "FLIGHT"),
          "Every node, every epoch; before the first epoch every 100 ms with counter 0.",
          _enum("state", 4, "NodeState", "node state"),
          _u("boot_count", 8, "starts since commissioning, modulo 256"),
          _u("contract_hash", 32, "first 4 bytes, big-endian, of SHA-256 of the DBC file"),
          per="node", stride=1),
    # --- bench: lockstep ------------------------------------------------------------------------------
    _kind("BENCH_SYNC", 0x7D0, "TIME", ("FLIGHT",), "Ends the emulator's block of an epoch.",
          *_BENCH, _u("count", 16, "frames in the block")),
    _kind("BENCH_DONE", 0x7D1, "FLIGHT", ("TIME",), "Ends the flight node's block of an epoch.",
          *_BENCH, _u("count", 16, "frames in the block")),
    _kind("BENCH_END", 0x7DE, "TIME", ("FLIGHT",),
          "The run is over; nodes may leave. Carries the number of the epoch that will not come.",
          *_BENCH, _enum("reason", 4, "EndReason", "why")),
)  # fmt: skip

KIND_BY_NAME = {kind.name: kind for kind in KINDS}
MEASUREMENT_KINDS = tuple(k.name for k in KINDS if 0x100 <= k.base < 0x10A)


def values_of(kind: str, signal: str) -> int:
    """How many values a signal of a kind can have."""
    bits = next(s.bits for s in KIND_BY_NAME[kind].signals if s.name == signal)
    return 1 << bits


def node_names(receivers: int) -> dict[str, int]:
    """DBC node name -> node number, for a contract with this many receivers."""
    return {**{f"RX{r}": r for r in range(1, receivers + 1)}, **NODES}


@dataclass(frozen=True, slots=True)
class Message:
    """A kind at one identifier."""

    can_id: int
    name: str
    kind: Kind
    sender: str
    receivers: tuple[str, ...]


def messages(receivers: int) -> Iterator[Message]:
    """All messages of a contract with `receivers` receivers, by identifier."""
    if not 1 <= receivers <= MAX_RECEIVERS:
        raise ValueError(f"{receivers} receivers; a contract has 1 to {MAX_RECEIVERS}")
    nodes = node_names(receivers)

    def expand(names: tuple[str, ...], number: int) -> tuple[str, ...]:
        out: list[str] = []
        for name in names:
            every = [f"RX{r}" for r in range(1, receivers + 1)]
            out += [f"RX{number}"] if name == "RX" and number else every if name == "RX" else [name]
        return tuple(out)

    found = []
    for kind in KINDS:
        if kind.per == "receiver":
            for r in range(1, receivers + 1):
                sender = f"RX{r}" if kind.sender == "RX" else kind.sender
                can_id = kind.base + kind.stride * (r - 1)
                found.append(Message(can_id, f"RX{r}_{kind.name}", kind, sender, expand(kind.receivers, r)))
        elif kind.per == "node":
            for node, number in nodes.items():
                others = tuple(n for n in kind.receivers if n != node)
                found.append(Message(kind.base + number - 1, f"{node}_{kind.name}", kind, node, others))
        else:
            found.append(Message(kind.base, kind.name, kind, kind.sender, expand(kind.receivers, 0)))
    return iter(sorted(found, key=lambda m: m.can_id))


check(KINDS, NODES)
