"""A reference orbit at the tags of a receiver, about its ends: against a circle in closed form."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from gnss_hil.emulator.assemble.recorded import _reference
from gnss_hil.emulator.config.scenario import ScenarioError
from gnss_hil.emulator.config.tables import TrajectoryFile
from gnss_hil.emulator.orbits.trajectory import Trajectory
from gnss_hil.emulator.receivers.recorded.reference import reference

pytestmark = pytest.mark.verifies(
    "emulator/receivers/recorded/reference.py",
    what="A reference orbit about its ends",
    by="a circle in closed form, by a table of a minute",
    status="validated",
)

START_NS, STEP_S, LAST_S = 1_300_000_000 * 10**9, 60.0, 3600.0
RADIUS_M, RATE_RPS = 6.8e6, 1.1e-3


def circle(t_s):
    """Position and velocity (q, 3)."""
    angle = RATE_RPS * np.atleast_1d(t_s)
    cosine, sine, none = np.cos(angle), np.sin(angle), np.zeros(len(angle))
    pos = RADIUS_M * np.stack((cosine, sine, none), axis=1)
    return pos, RADIUS_M * RATE_RPS * np.stack((-sine, cosine, none), axis=1)


def ns(t_s):
    return START_NS + round(t_s * 1e9)


def table():
    t_s = np.arange(0.0, LAST_S + 1, STEP_S)
    return reference(Trajectory(START_NS + (t_s * 1e9).astype(np.int64), circle(t_s)[0]))


@pytest.mark.parametrize("t_s", [0.0, LAST_S, -1e-7, LAST_S + 1e-7, -0.59, LAST_S + 0.59, 1234.5])
def test_within_a_hundredth_of_a_step_beyond_its_ends_it_goes_on(t_s):
    orbit = table()
    assert orbit.holds(ns(t_s))
    state, (pos, vel) = orbit.at(ns(t_s)), circle(t_s)
    assert np.abs(state.pos_ecef_m - pos[0]).max() < 1e-3
    assert np.abs(state.vel_ecef_mps - vel[0]).max() < 3e-3


@pytest.mark.parametrize("t_s", [-0.7, LAST_S + 0.7, -30.0, LAST_S + 60])
def test_farther_away_nothing_is_known(t_s):
    assert not table().holds(ns(t_s))


HEAD = "CCSDS_OEM_VERS = 2.0\nMETA_START\nOBJECT_NAME = X\nREF_FRAME = ITRF\nTIME_SYSTEM = GPS\nMETA_STOP\n"


@pytest.fixture
def settings(tmp_path):
    """An hour of a minute's step from 2024-03-01 on."""
    t_s = np.arange(0.0, LAST_S + 1, STEP_S)
    pos = circle(t_s)[0] / 1e3
    lines = [
        f"2024-03-01T{int(t) // 3600:02d}:{int(t) // 60 % 60:02d}:00 {x:.9f} {y:.9f} {z:.9f} 0 0 0"
        for t, (x, y, z) in zip(t_s, pos, strict=True)
    ]
    (tmp_path / "x.oem").write_text(HEAD + "\n".join(lines) + "\n")
    return SimpleNamespace(reference=TrajectoryFile(oem=str(tmp_path / "x.oem")))


def marks_ns(begin_s, end_s, step_s=10.0):
    from datetime import datetime

    from gnss_hil.dbc.common import gpstime

    first = gpstime.from_calendar(datetime(2024, 3, 1))
    return first + np.round(np.arange(begin_s, end_s + 1e-6, step_s) * 1e9).astype(np.int64)


def words(told):
    return [line for line in told if "judged by nothing" in line]


def test_tags_a_hair_beyond_a_table_are_judged_by_it(settings):
    """Tags of a receiver's own clock: 50 ns early at the first, and late at the last."""
    told, tags = [], marks_ns(0, LAST_S)
    tags[0] -= 50
    tags[-1] += 50
    orbit = _reference(settings, tags, None, "craft.x.observations.reference", told.append)
    assert orbit is not None
    assert orbit.known(tags).all()
    assert not words(told)


@pytest.mark.parametrize(
    ("begin_s", "end_s", "unknown"), [(-5, LAST_S, 1), (-25, LAST_S, 3), (5, LAST_S + 10, 1)]
)
def test_tags_beyond_a_table_are_counted_and_the_others_judged(settings, begin_s, end_s, unknown):
    told, tags = [], marks_ns(begin_s, end_s)
    orbit = _reference(settings, tags, None, "craft.x.observations.reference", told.append)
    assert orbit is not None
    assert np.count_nonzero(~orbit.known(tags)) == unknown
    (line,) = words(told)
    assert line.startswith(
        "craft.x.observations.reference: states from 2024-03-01T00:00:00 to 2024-03-01T01:00:00"
    )
    assert line.endswith(
        f"{unknown} of {len(tags)} epochs {'is' if unknown == 1 else 'are'} judged by nothing"
    )


def test_a_reference_of_another_day_is_refused(settings):
    with pytest.raises(ScenarioError, match=r"reference: .*states from .* the run is from"):
        _reference(
            settings, marks_ns(LAST_S + 60, LAST_S + 600), None, "craft.x.observations.reference", print
        )
