"""What a navigator of somebody else's hands on is judged: nonsense is no fix, and points no antenna.

The navigator here is the tests' own: all in view, whose solution is spoilt in one field.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from gnss_hil.dbc.common import vehicle
from gnss_hil.flightsw.app.config import configure
from gnss_hil.flightsw.estimation.all_in_view import all_in_view
from gnss_hil.flightsw.estimation.registry import NAVIGATORS, NavigatorRow
from gnss_hil.flightsw.estimation.snapshot import SnapshotNavigator
from gnss_hil.flightsw.integrity.publishable import publishable
from gnss_hil.flightsw.records.solution import (
    FARTHEST_M,
    FASTEST_MPS,
    Fix,
    FixMode,
    NoFix,
    OrbitState,
    Solution,
    SolutionError,
    carriable,
)
from tests.support.flights import SKY, drop, fly, soyuz, status
from tests.support.flown import CODEC, FakeBus

pytestmark = pytest.mark.verifies(
    "flightsw/integrity/publishable.py",
    "flightsw/records/solution.py",
    "flightsw/app/step.py",
    what="Navigators that hand on nonsense",
    by="a navigator of the tests' own whose solution is spoilt field by field, flown through the step",
    status="modelled",
)

SOYUZ = vehicle.load(vehicle.find("soyuz-ms"))
NAN, INF = np.nan, np.inf
ROWS = 5


@dataclass(frozen=True)
class Spoilt(SnapshotNavigator):
    """All in view, whose published solution is another; what it keeps for itself is sound."""

    spoil: Callable[[Solution], Solution]

    def update(self, state, z, inputs):
        state, solution = SnapshotNavigator.update(self, state, z, inputs)
        return state, self.spoil(solution)


def flown(monkeypatch, spoil, tamper=lambda epoch, block: block):
    """State and answer of the third epoch."""
    row = NavigatorRow("spoilt", lambda _: Spoilt(all_in_view, spoil), "made up", "spoilt")
    monkeypatch.setitem(NAVIGATORS, "spoilt", row)
    states, answers, _ = fly(
        FakeBus(soyuz(), SKY), configure(SOYUZ, "patent", navigator_name="spoilt"), 3, tamper=tamper
    )
    return states[-1], answers[-1]


def of_kind(answer, kind):
    """Frames of one kind in an answer."""
    return np.flatnonzero(answer.can_id == CODEC.can_id_of[kind, 0])


def of_fix(**changed):
    return lambda solution: replace(solution, fix=replace(solution.fix, **changed))


def scaled(solution: Solution) -> Solution:
    """A position in millimetres, also of the orbit."""
    position = solution.fix.position_m * 1e3
    return replace(
        solution,
        fix=replace(solution.fix, position_m=position),
        orbit=replace(solution.orbit, position_m=position),
    )


@pytest.mark.parametrize(
    "spoil",
    [
        of_fix(position_m=np.array([NAN, 4e6, 5e6])),
        of_fix(position_m=np.array([4e6, 5e6, NAN])),
        scaled,
        of_fix(clock_m=np.array([3.0, INF])),
        of_fix(covariance_m2=np.diag([1.0, -1.0, 1.0])),
        of_fix(pdop=NAN),
        of_fix(clock_variance_m2=np.array([NAN, 1.0])),
        of_fix(clock_variance_m2=np.array([1.0, -1.0])),
        of_fix(misfit=NAN),
    ],
)
def test_a_fix_of_nonsense_is_none_and_points_no_antenna(monkeypatch, spoil):
    state, answer = flown(monkeypatch, spoil)
    assert status(answer, "mode") == FixMode.NO_FIX and status(answer, "no_fix") == NoFix.NO_CONVERGENCE
    assert state.solution.fix is None and state.solution.orbit is None
    assert state.without_fix == 3


@pytest.mark.parametrize(
    "changed",
    [
        {"velocity_mps": np.array([7e3, NAN, 0.0])},
        {"velocity_mps": np.array([7e3, 1.01 * FASTEST_MPS, 0.0])},
        {"drift_mps": np.array([1.0, INF])},
        {"velocity_covariance_m2ps2": np.diag([1.0, -1.0, 1.0])},
        {"velocity_covariance_m2ps2": np.diag([1.0, 1.0, NAN])},
        {"velocity_covariance_m2ps2": np.eye(3) + 2 * np.eye(3)[::-1]},
        {"drift_variance_m2ps2": np.array([-1.0, 1.0])},
        {"drift_variance_m2ps2": np.array([1.0, INF])},
    ],
)
def test_a_velocity_of_nonsense_is_left_out(monkeypatch, changed):
    state, answer = flown(monkeypatch, of_fix(**changed))
    assert status(answer, "mode") == FixMode.POSITION and status(answer, "no_fix") == NoFix.FIX
    assert state.solution.fix.velocity_mps is None and state.solution.fix.drift_mps is None
    assert not len(of_kind(answer, "NAV_VSIGMA")) and not len(of_kind(answer, "NAV_VCORR"))
    assert np.linalg.norm(state.solution.orbit.velocity_mps) > 7000, "what the navigator says of it is sound"


def test_an_orbit_of_nonsense_points_no_antenna_whether_there_is_a_fix_or_not(monkeypatch):
    nowhere = OrbitState(0, np.array([NAN, 0, 0]), None, 0)
    state, answer = flown(monkeypatch, lambda solution: replace(solution, orbit=nowhere))
    assert status(answer, "no_fix") == NoFix.FIX and state.solution.orbit is None
    without = drop(["RANGE"], [2])
    state, answer = flown(monkeypatch, lambda solution: replace(solution, orbit=nowhere), without)
    assert status(answer, "no_fix") == NoFix.TOO_FEW_SATELLITES and state.solution.orbit is None


def fix(**changed) -> Fix:
    sound = Fix(
        position_m=np.array([4e6, -5e6, 2e6]), velocity_mps=np.array([1.0, 7e3, 2.0]), items=(0, 8),
        clock_m=np.array([1e5, -40.0]), drift_mps=np.array([3.0, 0.1]), covariance_m2=np.eye(3),
        used=np.ones(ROWS, bool), satellites=ROWS, residual_m=np.zeros(ROWS), pdop=None,
    )  # fmt: skip
    return replace(sound, **changed)


def solution_of(found: Fix) -> Solution:
    return Solution(NoFix.FIX, found, OrbitState(0, found.position_m, found.velocity_mps, 0))


def test_what_is_sound_stays_itself():
    sound = solution_of(fix())
    assert publishable(sound, ROWS) is sound
    apart = replace(sound, orbit=OrbitState(0, np.array([4e6, 0, 0]), np.array([0, 7e3, 0]), 0))
    judged = publishable(apart, ROWS)
    assert judged.fix is apart.fix and judged.orbit is apart.orbit
    still = solution_of(fix(velocity_mps=None, drift_mps=None))
    assert publishable(still, ROWS) is still
    coasting = Solution(NoFix.NO_ATTITUDE, None, apart.orbit)
    assert publishable(coasting, ROWS) is coasting


def test_an_orbit_loses_a_velocity_of_nonsense_alone():
    wild = OrbitState(7, np.array([4e6, 0, 0]), np.array([0, NAN, 0]), 5)
    judged = publishable(Solution(NoFix.NO_ATTITUDE, None, wild), ROWS).orbit
    assert judged.velocity_mps is None and judged.position_m is wild.position_m
    assert (judged.t_ns, judged.fix_ns) == (7, 5)
    spoilt = publishable(solution_of(fix(velocity_mps=np.array([INF, 0, 0]))), ROWS)
    assert spoilt.fix.velocity_mps is None and spoilt.orbit.velocity_mps is None


@pytest.mark.parametrize(("row", "column"), [(0, 1), (0, 2), (1, 2)])
def test_correlations_are_at_most_one(row, column):
    sigma = np.array([2.0, 3.0, 0.5])
    refused = dict.fromkeys((1.001, -1.001, NAN, INF), NoFix.NO_CONVERGENCE)
    for factor, reason in {**dict.fromkeys((1, 1 + 1e-12, -1), NoFix.FIX), **refused}.items():
        covariance = np.diag(sigma**2)
        covariance[row, column] = covariance[column, row] = factor * sigma[row] * sigma[column]
        assert publishable(solution_of(fix(covariance_m2=covariance)), ROWS).reason is reason


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("variance", [0.0, -1.0, NAN, INF, 1e300])
def test_variances_are_positive_and_finite(axis, variance):
    diagonal = np.ones(3)
    diagonal[axis] = variance
    judged = publishable(solution_of(fix(covariance_m2=np.diag(diagonal))), ROWS)
    assert judged.reason is NoFix.NO_CONVERGENCE and judged.orbit is None


@pytest.mark.parametrize("axis", range(3))
def test_what_the_bus_carries_is_by_axis_and_no_number_hides_behind_another(axis):
    corner = np.full(3, FARTHEST_M)
    assert carriable(corner, -corner)
    for wrong in (1.0001 * FARTHEST_M, -1.0001 * FARTHEST_M, NAN, INF):
        beyond = corner.copy()
        beyond[axis] = wrong
        assert not carriable(beyond, corner) and not carriable(corner, beyond)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"used": np.arange(ROWS)}, "used: of int64, has to be of bool"),
        ({"used": np.ones(ROWS - 1, bool)}, r"used: of shape \(4,\), has to be of shape \(5,\)"),
        ({"residual_m": np.zeros(ROWS + 1)}, r"residual_m: of shape \(6,\), has to be of shape \(5,\)"),
        ({"used": np.ones(2, bool), "residual_m": np.zeros(2)}, r"residual_m: of shape \(2,\), has to be of"),
        ({"used": [True] * ROWS}, r"used: no array but list, has to be of shape \(5,\)"),
        ({"position_m": np.zeros(4)}, r"position_m: of shape \(4,\), has to be of shape \(3,\)"),
        ({"clock_m": np.zeros(1)}, r"clock_m: of shape \(1,\), has to be of shape \(2,\)"),
        ({"covariance_m2": np.ones(3)}, r"covariance_m2: of shape \(3,\), has to be of shape \(3, 3\)"),
        ({"drift_mps": None}, "drift_mps: no array but NoneType"),
        ({"velocity_mps": None}, "velocity_mps: no array but NoneType"),
        ({"velocity_mps": np.zeros((3, 1))}, r"velocity_mps: of shape \(3, 1\)"),
        ({"velocity_covariance_m2ps2": np.ones(3)}, r"velocity_covariance_m2ps2: of shape \(3,\), has to be"),
        ({"clock_variance_m2": np.ones(3)}, r"clock_variance_m2: of shape \(3,\), has to be of shape \(2,\)"),
        ({"drift_variance_m2ps2": np.ones(1)}, r"drift_variance_m2ps2: of shape \(1,\), has to be of"),
        (
            {"velocity_mps": None, "drift_mps": None, "drift_variance_m2ps2": np.ones(2)},
            "drift_variance_m2ps2: of a fix without velocity",
        ),
        ({"drift_mps": np.zeros(3)}, r"drift_mps: of shape \(3,\), has to be of shape \(2,\)"),
    ],
)
def test_what_only_an_author_gets_wrong_is_an_error_with_the_navigators_name(monkeypatch, changed, message):
    with pytest.raises(SolutionError, match=message):
        publishable(Solution(NoFix.FIX, fix(**changed)), ROWS)
    with pytest.raises(SolutionError, match=r"^navigator 'spoilt': "):
        flown(monkeypatch, of_fix(**changed))


@pytest.mark.parametrize("place", ["position_m", "velocity_mps"])
def test_an_orbit_of_another_shape_is_an_error_too(place):
    orbit = replace(OrbitState(0, np.zeros(3), np.zeros(3), 0), **{place: np.zeros(2)})
    with pytest.raises(SolutionError, match=rf"orbit\.{place}: of shape \(2,\), has to be of shape \(3,\)"):
        publishable(Solution(NoFix.NO_ATTITUDE, None, orbit), ROWS)


def test_reason_and_fix_do_not_contradict_each_other(monkeypatch):
    with pytest.raises(SolutionError, match=r"reason: <NoFix\.FIX: 0> without a fix"):
        Solution(NoFix.FIX)
    with pytest.raises(SolutionError, match=r"reason: <NoFix\.NO_ATTITUDE: 5> with a fix"):
        Solution(NoFix.NO_ATTITUDE, fix())
    with pytest.raises(SolutionError, match=r"navigator 'spoilt': reason: <NoFix\.FIX: 0> without a fix"):
        flown(monkeypatch, lambda solution: Solution(NoFix.FIX))
