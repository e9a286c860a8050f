"""Navigators that solve every epoch by itself; the orbit is kept from epoch to epoch, for the next start."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.flightsw.estimation.base import FixInputs
from gnss_hil.flightsw.estimation.carried import Ways, begun, carried_on, gone_astray
from gnss_hil.flightsw.estimation.prior import contradicted, prior_of, trusted_s
from gnss_hil.flightsw.estimation.propagate_to_mark import in_doubt, orbit_in_doubt, propagated_to_mark
from gnss_hil.flightsw.estimation.receiver_delays import EVERY_S, forgotten
from gnss_hil.flightsw.orbit.propagator import propagate
from gnss_hil.flightsw.records.ranges import Ranges
from gnss_hil.flightsw.records.solution import (
    Fix,
    NoFix,
    OrbitState,
    ReceiverDelays,
    SnapshotFix,
    Solution,
    Tested,
)

MAX_COAST_S = 3600.0
"""So long after the last fix the position is forgotten and the next fix starts cold."""


FORGOTTEN_S = 60.0
"""So long ranges may contradict each other before delays of receivers that were learnt are not believed any
more: a receiver that was restarted and does not say so, or whose line was changed, is late by something else,
and by what was known of it no fix would ever be consistent again."""


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """orbit     of the last fix, propagated; None without one
    antenna   the selected antenna, for navigators that select one; -1 none
    delays    of the receivers, for navigators that solve for all together; None before anything is learnt
    t_ns      of the epoch;  unlearnt_s  since delays were learnt
    left_out_s   (m,) for so long each receiver's ranges were left out; None before any fix
    ways      positions of minutes ago, carried on by velocities
    """

    orbit: OrbitState | None = None
    antenna: int = -1
    t_ns: int = 0
    delays: ReceiverDelays | None = None
    unlearnt_s: float = 0.0
    left_out_s: F64 | None = None
    ways: Ways = ()

    @property
    def start_m(self) -> F64 | None:
        """(3,) where the search for the position starts; None: the Earth's centre."""
        return None if self.orbit is None else self.orbit.position_m


Solve = Callable[[Ranges, FixInputs, Snapshot], tuple[Fix | NoFix, int]]
"""The fix of an epoch, and which antenna is selected from now on."""


@dataclass(frozen=True, slots=True, eq=False)
class SnapshotNavigator:
    """A Navigator[Snapshot] around a way to solve one epoch.

    judged   whether `solve` holds ranges against the orbit before itself, where marks are GPS time
    """

    solve: Solve
    judged: bool = field(default=False, kw_only=True)

    def initial(self) -> Snapshot:
        return Snapshot()

    def predict(self, state: Snapshot, t_ns: int) -> Snapshot:
        dt_s = max((t_ns - state.t_ns) * 1e-9, 0.0) if state.t_ns else EVERY_S
        orbit = coasted(state.orbit, t_ns)
        left_out_s = None if state.left_out_s is None else state.left_out_s + dt_s
        return Snapshot(
            orbit, state.antenna, t_ns, state.delays, state.unlearnt_s + dt_s, left_out_s, state.ways
        )

    def update(self, state: Snapshot, z: Ranges, inputs: FixInputs) -> tuple[Snapshot, Solution]:
        if state.delays is not None and inputs.restarted is not None and inputs.restarted.any():
            state = replace(state, delays=forgotten(state.delays, inputs.restarted, inputs.budget.delay_m))
        if inputs.mark_doubt_s and state.orbit is not None:
            state = replace(state, orbit=orbit_in_doubt(state.orbit, inputs.mark_doubt_s))
        fix, antenna = self._at_mark(z, inputs, state)
        if isinstance(fix, Fix) and inputs.rules.refuse:
            ways = carried_on(state.ways, state.t_ns, fix)
            state = replace(state, ways=ways)
            for astray in gone_astray(ways, state.t_ns, fix)[:1]:
                fix, antenna = self._at_mark(z, inputs, replace(state, orbit=astray.orbit))
                if isinstance(fix, Fix) and gone_astray(ways, state.t_ns, fix):
                    fix = NoFix.AGAINST_ORBIT
        if isinstance(fix, NoFix):
            state = _doubted(state) if fix is NoFix.INCONSISTENT_RANGES else state
            return replace(state, antenna=antenna), Solution(fix, None, state.orbit)
        last_mps = None if state.orbit is None else state.orbit.velocity_mps
        velocity = last_mps if fix.velocity_mps is None else fix.velocity_mps
        orbit = OrbitState(
            state.t_ns,
            fix.position_m,
            velocity,
            state.t_ns,
            fix.covariance_m2 * fix.misfit,
            fix.velocity_covariance_m2ps2,
            trusted_s(fix, state.orbit),
            fix.tested is not Tested.UNTESTED,
        )
        learnt = fix.delays if isinstance(fix, SnapshotFix) else None
        if learnt is None:
            doubted = _doubted(state)
            delays, unlearnt_s = doubted.delays, doubted.unlearnt_s
        else:
            delays, unlearnt_s = learnt, 0.0
        left_out_s = _left_out_s(state, z.receiver, fix.used, len(inputs.domain))
        if delays is not None and (left_out_s > FORGOTTEN_S).any():
            delays = forgotten(delays, left_out_s > FORGOTTEN_S, inputs.budget.delay_m)
        ways = begun(state.ways, state.t_ns, fix)
        after = Snapshot(orbit, antenna, state.t_ns, delays, unlearnt_s, left_out_s, ways)
        return after, Solution(NoFix.FIX, fix, orbit)

    def _at_mark(self, z: Ranges, inputs: FixInputs, state: Snapshot) -> tuple[Fix | NoFix, int]:
        """The fix at the time mark if the orbit does not contradict it, and the antenna."""
        fix, antenna = self.solve(z, inputs, state)
        last_mps = None if state.orbit is None else state.orbit.velocity_mps
        if isinstance(fix, Fix):
            fix = propagated_to_mark(fix, inputs.mark_clock, last_mps)
        if isinstance(fix, Fix) and inputs.mark_doubt_s:
            fix = in_doubt(fix, inputs.mark_doubt_s, last_mps)
        if isinstance(fix, Fix) and inputs.rules.refuse and not (self.judged and inputs.mark_clock == 0):
            prior = prior_of(state.orbit)
            if prior is not None and contradicted(fix, prior):
                fix = NoFix.AGAINST_ORBIT
        return fix, antenna


def _left_out_s(state: Snapshot, receiver: I64, used: Bool, receivers: int) -> F64:
    """(m,) after a fix that used some of the ranges (n,) of these receivers: 0 of those it has any of."""
    out_s = np.zeros(receivers) if state.left_out_s is None else state.left_out_s.copy()
    offering = np.bincount(receiver, minlength=receivers)
    out_s[(offering == 0) | (np.bincount(receiver[used], minlength=receivers) > 0)] = 0.0
    return out_s


def _doubted(state: Snapshot) -> Snapshot:
    """After an epoch that told nothing of delays: what was learnt of them is forgotten if that lasts."""
    if state.unlearnt_s <= FORGOTTEN_S:
        return state
    return replace(state, delays=None, unlearnt_s=EVERY_S)


def coasted(orbit: OrbitState | None, t_ns: int) -> OrbitState | None:
    """The last position propagated to t_ns; without a velocity, or too long after the last fix, it is
    forgotten."""
    if orbit is None or orbit.velocity_mps is None or t_ns < orbit.t_ns:
        return None
    if (t_ns - orbit.fix_ns) * 1e-9 > MAX_COAST_S:
        return None
    dt_s = (t_ns - orbit.t_ns) * 1e-9
    position, velocity = propagate(orbit.position_m, orbit.velocity_mps, dt_s)
    return replace(orbit, t_ns=t_ns, position_m=position, velocity_mps=velocity)
