"""Value tables: what the raw values of signals mean. Labels are what people and reports see."""

from __future__ import annotations

from gnss_hil.dbc.common.signals import SIGNALS
from gnss_hil.dbc.common.systems import CLOCK_DOMAINS, SYSTEMS

TIME_OFFSETS = {
    s.time_offset_item: s.name.upper() for s in SYSTEMS.values() if s.time_offset_item is not None
}
"""Item of NAV_CLOCK -> label of the system whose time offset it carries."""

VALUES: dict[str, dict[int, str]] = {
    "SatSystem": {s.value: s.name.upper() for s in SYSTEMS.values()},
    "Signal": dict(sorted((s.value, s.name) for s in SIGNALS.values())),
    "Lock": {0: "IDLE", 1: "SEARCH", 2: "CODE", 3: "CARRIER", 4: "BIT_SYNC", 5: "FULL"},
    "Action": {0: "RELEASE", 1: "TRACK", 2: "AUTONOMOUS"},
    "AckResult": {
        0: "ACCEPTED", 1: "NO_SUCH_CHANNEL", 2: "NO_SUCH_SATELLITE", 3: "NOT_IN_ALMANAC", 4: "UNHEALTHY",
        5: "BEHIND_EARTH", 6: "ALREADY_TRACKED_HERE", 7: "NO_SUCH_SIGNAL", 8: "BAD_ACTION",
    },
    "ReceiverState": {0: "OFF", 1: "START", 2: "AUTONOMOUS", 3: "COMMANDED", 4: "FAULT"},
    "NodeState": {0: "INIT", 1: "READY", 2: "RUNNING", 3: "DEGRADED", 4: "STOPPING"},
    "NavMode": {0: "NO_FIX", 1: "POSITION", 2: "POSITION_VELOCITY"},
    "NoFix": {
        0: "FIX", 1: "TOO_FEW_SATELLITES", 2: "SINGULAR_GEOMETRY", 3: "NO_CONVERGENCE", 4: "NO_TIME_MARK",
        5: "NO_ATTITUDE", 6: "INCONSISTENT_RANGES", 7: "NO_VELOCITY", 8: "AGAINST_ORBIT",
    },
    "FlightMode": {
        0: "STANDBY", 1: "START", 2: "NAVIGATING", 3: "COASTING", 4: "LOST", 5: "SURRENDERED",
    },
    "Refused": {
        1: "LOST", 2: "REPEATED", 3: "WRONG_SEQUENCE", 4: "CORRUPTED", 5: "UNKNOWN_ID", 6: "WRONG_LENGTH",
        7: "REMOTE", 8: "EXTENDED", 9: "ERROR_FRAME", 10: "MIXED_EPOCH", 16: "NO_TIME_MARK", 17: "SURPLUS",
        18: "INCOMPLETE", 19: "BAD_TIME_MARK", 20: "OTHER_SESSION", 21: "OTHER_CONTRACT", 22: "TIMED_OUT",
        23: "CONTRADICTED", 24: "STREAM_NOT_VALID", 25: "JUMPED", 26: "NO_ORBIT", 27: "MOVED", 28: "TURNED",
    },
    "Tested": {0: "UNTESTED", 1: "CHECKED", 2: "TESTED"},
    "MarkClock": {0: "GPS", **{k + 1: f"DOMAIN_{k}" for k in range(CLOCK_DOMAINS)}},
    "ClockItem": {
        **{k: f"DOMAIN_{k}" for k in range(CLOCK_DOMAINS)},
        **{item: f"{label}_OFFSET" for item, label in sorted(TIME_OFFSETS.items())},
    },
    "Flag": {0: "NO", 1: "YES"},
    "Health": {0: "HEALTHY", 1: "UNHEALTHY"},
    "EndReason": {0: "COMPLETED", 1: "INTERRUPTED", 2: "FAILED"},
}  # fmt: skip
"""Name of the table -> {raw: label}."""


def raw_of(table: str) -> dict[str, int]:
    """Raw values of a value table by their labels."""
    return {label: raw for raw, label in VALUES[table].items()}
