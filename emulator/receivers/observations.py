"""Observations: what the measuring channels of a craft observe of their satellites in one epoch."""

from __future__ import annotations

from dataclasses import dataclass

from gnss_hil.dbc.common.arrays import F64, I64, Bool


@dataclass(frozen=True, slots=True, eq=False)
class Observations:
    """One row for each measuring channel, by receiver and channel; names and conventions of the contract.

    receiver        (p,) 0-based;  channel (p,);  row (p,) of the sky;  sat (p,) satellite index
    signal          (p,) value of the contract's table "Signal"
    pseudorange_m, range_rate_mps, phase_cyc, cn0_dbhz   (p,)
    slips           (p,);  half_cycle (p,) whether half a cycle is in doubt
    pos_ecef_m, vel_ecef_mps   (p, 3) satellite at transmission, axes of that instant
    clock_m, clock_drift_mps   (p,) as broadcast, at transmission
    """

    receiver: I64
    channel: I64
    row: I64
    sat: I64
    signal: I64
    pseudorange_m: F64
    range_rate_mps: F64
    phase_cyc: F64
    cn0_dbhz: F64
    slips: I64
    half_cycle: Bool
    pos_ecef_m: F64
    vel_ecef_mps: F64
    clock_m: F64
    clock_drift_mps: F64
