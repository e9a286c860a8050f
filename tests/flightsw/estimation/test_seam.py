"""The estimator's seam: kinds of measurement predict what their Jacobians say, and another navigator flies.

The filter here is the tests' own, of a textbook: it uses the kinds of measurement by protocol alone,
and the flight step does not know it from a snapshot navigator.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest

from gnss_hil.dbc.common import vehicle
from gnss_hil.dbc.common.satellites import NUMBERS
from gnss_hil.flightsw.app.config import configure
from gnss_hil.flightsw.attitude.attitude import levers_ecef
from gnss_hil.flightsw.estimation.clocks import clock_columns
from gnss_hil.flightsw.estimation.registry import NAVIGATORS, NavigatorRow
from gnss_hil.flightsw.measurement.base import Measurement, Point, Unknown
from gnss_hil.flightsw.measurement.budget import range_errors
from gnss_hil.flightsw.measurement.code_range import code_ranges
from gnss_hil.flightsw.measurement.range_rate import range_rates
from gnss_hil.flightsw.measurement.registry import OTHER_KINDS, MeasurementRow
from gnss_hil.flightsw.orbit.propagator import propagate
from gnss_hil.flightsw.records.solution import Fix, FixMode, NoFix, OrbitState, Solution
from tests.support import synthetic_epochs as s
from tests.support.budgets import BUDGET
from tests.support.fixes import craft, in_view, measurements
from tests.support.flights import SKY, drop, error_m, fly, soyuz, status
from tests.support.flown import FakeBus, decoded

pytestmark = pytest.mark.verifies(
    "flightsw/estimation/base.py",
    "flightsw/estimation/registry.py",
    "flightsw/measurement/base.py",
    "flightsw/measurement/registry.py",
    "flightsw/records/solution.py",
    what="Navigators as a seam: kinds of measurement, prediction, update",
    by="Jacobians by central differences; a filter of the tests' own flies through the same step",
    status="modelled",
)

SOYUZ = vehicle.load(vehicle.find("soyuz-ms"))
BLOCKS = {Unknown.POSITION: "position_m", Unknown.VELOCITY: "velocity_mps",
          Unknown.CLOCK: "clock_m", Unknown.DRIFT: "drift_mps"}  # fmt: skip


def kinds(z, lever, lever_rate, domain, position_m) -> tuple[tuple[int, ...], Sequence[Measurement]]:
    """Items of the clocks, and the code and rate measurements of ranges z."""
    items, columns = clock_columns(domain, z.sat // NUMBERS)
    code = code_ranges(z, lever, columns, range_errors(z, BUDGET, None))
    rays = code.rays(position_m)
    return items, (code, range_rates(z, code.design(rays), rays, lever_rate))


def at_truth(c):
    position, velocity = s.truth_ecef(c)
    clock, drift = s.C * np.array([1e-3, 3e-8]), s.C * np.array([2e-8, 0.0])
    return Point(position, velocity, clock, drift)


@pytest.fixture(scope="module")
def measured():
    c = craft()
    m = measurements(s.observe(c, in_view(c, 40), SKY))
    dcm = c.dcm_body_from_eci @ s.ecef_from_eci(0.0).T
    rate = c.rate_body - dcm @ [0, 0, s.W]
    lever, lever_rate = c.lever_body @ dcm, np.cross(rate, c.lever_body) @ dcm
    _, z = kinds(
        m, lever.T[:, m.receiver], lever_rate.T[:, m.receiver], c.domain[m.receiver], at_truth(c).position_m
    )
    return z, at_truth(c)


def test_at_the_truth_the_prediction_is_what_was_measured(measured):
    (code, rate), x = measured
    assert [z.kind for z in (code, rate)] == ["code", "rate"]
    assert code.predict(x) == pytest.approx(code.value, abs=1e-5)
    assert rate.predict(x) == pytest.approx(rate.value, abs=1e-4)


@pytest.mark.parametrize("kind", [0, 1])
def test_jacobians_by_central_differences(measured, kind):
    z, x = measured[0][kind], measured[1]
    columns = []
    for unknown in z.unknowns:
        value = getattr(x, BLOCKS[unknown])
        for step in 10.0 * np.eye(len(value)):
            up, down = (z.predict(replace(x, **{BLOCKS[unknown]: value + k * step})) for k in (1, -1))
            columns.append((up - down) / 20.0)
    # The flight time turns the satellite: 2e-5 of a step sideways.
    assert pytest.approx(z.jacobian(x), abs=5e-5) == np.array(columns).T


@dataclass(frozen=True)
class Tracked:
    """State vector (position, velocity, clock, offset, drift, its rate) and covariance."""

    t_ns: int
    x: np.ndarray
    covariance: np.ndarray


@dataclass(frozen=True)
class Filter:
    """An extended Kalman filter, started by the snapshot navigator's first fix."""

    first = NAVIGATORS["all_in_view"].build({})

    def initial(self):
        return None

    def predict(self, state, t_ns):
        if state is None:
            return self.first.predict(self.first.initial(), t_ns)
        dt = (t_ns - state.t_ns) * 1e-9
        position, velocity = propagate(state.x[:3], state.x[3:6], dt)
        clock = state.x[6:8] + dt * state.x[8:]
        moved = np.eye(10)
        moved[:3, 3:6] = moved[6:8, 8:] = 0
        moved[:3, 3:6], moved[6:8, 8:] = dt * np.eye(3), dt * np.eye(2)
        noise = np.diag([1e-2] * 3 + [1e-4] * 3 + [1e-2] * 2 + [1e-4] * 2)
        x = np.concatenate((position, velocity, clock, state.x[8:]))
        return Tracked(t_ns, x, moved @ state.covariance @ moved.T + noise)

    def update(self, state, z, inputs):
        if not isinstance(state, Tracked):
            snapshot, solution = self.first.update(state, z, inputs)
            if solution.fix is None or len(solution.fix.items) < 2:
                return None, solution
            fix = solution.fix
            x = np.concatenate((fix.position_m, fix.velocity_mps, fix.clock_m, fix.drift_mps))
            return Tracked(snapshot.t_ns, x, np.diag([1e2] * 3 + [1.0] * 3 + [1e2] * 2 + [1.0] * 2)), solution
        if not len(z) or inputs.attitude is None:
            orbit = OrbitState(state.t_ns, state.x[:3], state.x[3:6], state.t_ns)
            return state, Solution(NoFix.TOO_FEW_SATELLITES, None, orbit)
        lever, lever_rate = levers_ecef(inputs.attitude, inputs.lever_arm_body_m)
        rows = z.receiver
        items, every = kinds(z, lever.T[:, rows], lever_rate.T[:, rows], inputs.domain[rows], state.x[:3])
        x, covariance = state.x, state.covariance
        where = {Unknown.POSITION: [0, 1, 2], Unknown.VELOCITY: [3, 4, 5], Unknown.CLOCK: [6, 7],
                 Unknown.DRIFT: [8, 9]}  # fmt: skip
        for kind in (*every, *inputs.others):
            point = Point(x[:3], x[3:6], x[6:8], x[8:])
            h = np.zeros((len(kind.value), 10))
            h[:, [i for unknown in kind.unknowns for i in where[unknown]]] = kind.jacobian(point)
            gain = covariance @ h.T @ np.linalg.inv(h @ covariance @ h.T + np.diag(kind.variance))
            x = x + gain @ (kind.value - kind.predict(point))
            covariance = covariance - gain @ h @ covariance
        fix = Fix(
            position_m=x[:3], velocity_mps=x[3:6], items=items, clock_m=x[6:8], drift_mps=x[8:],
            covariance_m2=covariance[:3, :3], used=np.ones(len(z), bool), satellites=len(set(z.sat.tolist())),
            residual_m=np.zeros(len(z)), pdop=None,
        )  # fmt: skip
        orbit = OrbitState(state.t_ns, x[:3], x[3:6], state.t_ns)
        return Tracked(state.t_ns, x, covariance), Solution(NoFix.FIX, fix, orbit)


FILTER = NavigatorRow("filter", lambda _: Filter(), "textbook", "of the tests")


@dataclass(frozen=True)
class Radius:
    """A kind that no file of the flight software names: the distance from the Earth's centre."""

    value: np.ndarray
    variance: np.ndarray
    kind = "radius"
    unknowns = (Unknown.POSITION,)

    def predict(self, x):
        return np.array([np.linalg.norm(x.position_m)])

    def jacobian(self, x):
        return x.position_m[None, :] / np.linalg.norm(x.position_m)


@pytest.mark.slow
def test_a_kind_that_only_a_row_names_reaches_the_filter_and_no_other_navigator(monkeypatch):
    """A sharp radius that is 40 m too large draws the filter's radius after it; a snapshot stays as it is."""
    bus = FakeBus(soyuz(), SKY)

    def form(epoch):
        true = np.linalg.norm(s.truth_ecef(bus.craft, (epoch.mark.t_ns - s.T0_NS) * 1e-9)[0])
        return Radius(np.array([true + 40.0]), np.array([1e-6]))

    monkeypatch.setitem(NAVIGATORS, "filter", FILTER)
    alone = configure(SOYUZ, "patent")
    _, before, _ = fly(FakeBus(soyuz(), SKY), alone, 6)
    monkeypatch.setitem(OTHER_KINDS, "radius", MeasurementRow("radius", form, "made up"))
    _, after, _ = fly(FakeBus(soyuz(), SKY), alone, 6)
    assert after == before
    states, _, _ = fly(bus, configure(SOYUZ, "patent", navigator_name="filter"), 6)
    true = np.linalg.norm(s.truth_ecef(bus.craft, 5.0)[0])
    assert np.linalg.norm(states[-1].solution.fix.position_m) - true == pytest.approx(40.0, abs=1.0)


@pytest.mark.slow
def test_a_filter_of_the_tests_flies_through_the_same_step(monkeypatch):
    monkeypatch.setitem(NAVIGATORS, "filter", FILTER)
    config = configure(SOYUZ, "patent", navigator_name="filter")
    bus = FakeBus(soyuz(), SKY)
    states, answers, _ = fly(bus, config, 14)
    assert isinstance(states[-1].nav, Tracked) and status(answers[-1], "satellites") >= 22
    _, snapshots, _ = fly(FakeBus(soyuz(), SKY), configure(SOYUZ, "patent"), 14)
    dilutions = [decoded(answer[-1], "NAV_STATUS")["pdop"][0] for answer in (answers, snapshots)]
    assert dilutions[0] == pytest.approx(dilutions[1], abs=0.011), "a filter need not know its dilution"
    # Its orbit has J2, the sky of the tests has not: 1 cm/s^2.
    assert error_m(bus.craft, answers[-1], 13) < 0.2
    assert decoded(answers[-1], "NAV_CLOCK")["item"].tolist() == [0, 8]
    states, answers, _ = fly(bus, config, 3, states[-1], first=14, tamper=drop(["RANGE"], range(14, 17)))
    assert {status(answer, "no_fix") for answer in answers} == {NoFix.TOO_FEW_SATELLITES}
    assert states[-1].solution.mode is FixMode.NO_FIX and states[-1].solution.orbit is not None


@pytest.mark.parametrize("name", NAVIGATORS)
def test_policy_and_navigator_are_chosen_apart(name):
    config = configure(SOYUZ, "patent", navigator_name=name)
    bus = FakeBus(soyuz(), SKY)
    _, answers, _ = fly(bus, config, 6)
    assert config.navigator_name == name and bus.commands, "the policy commands with any navigator"
    assert status(answers[0], "no_fix") == NoFix.FIX
    alone = {receiver for receiver in decoded(answers[0], "NAV_USED")["receiver"][
        decoded(answers[0], "NAV_USED")["channels"] > 0].tolist()}  # fmt: skip
    assert alone == ({1} if name == "best_antenna" else {1, 2, 3, 4})


def test_an_unknown_navigator_is_one_line():
    with pytest.raises(ValueError, match="navigator 'best': not known; there are all_in_view, receiver_mean"):
        configure(SOYUZ, "patent", navigator_name="best")


def test_every_policy_names_a_navigator_of_the_table():
    for policy, name in {"patent": "all_in_view", "prototype": "all_in_view", "analogue": "receiver_mean",
                         "single": "best_antenna"}.items():  # fmt: skip
        assert configure(SOYUZ, policy).navigator_name == name
