"""Truth between its rows and beyond them, against a circle in closed form and a run at ten times the rate."""

from __future__ import annotations

import numpy as np
import polars
import pytest

from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.results import trajectory, truth
from gnss_hil.tools.results.trajectory import states

pytestmark = pytest.mark.verifies(
    "tools/results/trajectory.py",
    what="Truth at times that are no epoch's",
    by="a circle in closed form; truth of the same run at ten times the rate",
    status="validated",
)

S = 1_000_000_000
R_M, RATE = 6.8e6, 2 * np.pi / 5580


def circle(t_ns):
    angle = RATE * np.asarray(t_ns) / S
    cos, sin = np.cos(angle), np.sin(angle)
    return R_M * np.column_stack([cos, sin, 0 * cos]), R_M * RATE * np.column_stack([-sin, cos, 0 * cos])


def off_m(step_s, at_s):
    """Error at instants [s] of a circle that is known at 0, step, ... 300 s."""
    t_ns = np.arange(0, 300 * S + 1, round(step_s * S))
    at_ns = np.round(np.asarray(at_s) * S).astype(np.int64)
    position, velocity = states(t_ns, *circle(t_ns), at_ns)
    true_m, true_mps = circle(at_ns)
    assert np.linalg.norm(velocity - true_mps, axis=1)[np.isfinite(position[:, 0])] == pytest.approx(
        0, abs=0.2
    )
    return np.linalg.norm(position - true_m, axis=1)


@pytest.mark.parametrize(("step_s", "most_m"), [(0.1, 1e-7), (1, 1e-6), (10, 4e-4), (60, 0.5)])
def test_between_rows_it_is_the_cubic_s_error(step_s, most_m):
    """r'''' step^4 / 384."""
    found = off_m(step_s, np.linspace(0.03, 299.97, 997))
    assert found.max() < most_m


@pytest.mark.parametrize("step_s", [0.1, 1, 10, 60])
def test_ten_seconds_beyond_the_ends_are_known_and_no_more(step_s):
    near = off_m(step_s, [-10, -3, -0.3, 300.3, 303, 310])
    assert near.max() < (0.02 if step_s <= 10 else 0.4)
    assert np.isnan(off_m(step_s, [-10.001, 310.001, -1024 * 604_800, 1024 * 604_800])).all()


def test_a_row_is_taken_as_it_is():
    t_ns = np.arange(9) * 7
    position, velocity = circle(t_ns * S)
    velocity[4] = np.nan
    found = states(t_ns, position, velocity, t_ns[::-1])
    assert np.array_equal(found[0], position[::-1]) and np.array_equal(
        found[1], velocity[::-1], equal_nan=True
    )


def test_of_less_than_is_needed_nothing_is_known():
    """A gap of more than a minute, one row alone, none, rows without a velocity."""
    t_ns = np.array([0, 1, 63, 64]) * S
    found, _ = states(t_ns, *circle(t_ns), np.array([30, 63]) * S)
    assert np.isnan(found[0]).all() and np.isfinite(found[1]).all()
    for rows in (slice(0, 1), slice(0, 0)):
        found, _ = states(t_ns[rows], *(column[rows] for column in circle(t_ns)), np.array([S // 2]))
        assert np.isnan(found).all()
    position, velocity = circle(t_ns)
    assert np.isnan(states(t_ns, position, velocity * np.nan, np.array([S // 2]))[0]).all()
    short, _ = states(t_ns[:2], *(column[:2] for column in circle(t_ns)), np.array([2, 3]) * S)
    assert np.isfinite(short[0]).all() and np.isnan(short[1]).all(), "as far as it is long"


@pytest.fixture(scope="module")
def rates(tmp_path_factory):
    """Run folders of the same 30 s at 1 s and at 0.1 s."""
    folders = []
    for interval in ("1", "0.1"):
        folders.append(tmp_path_factory.mktemp("rates") / "run")
        command = ["run", "soyuz", "--bus", "inline", "--duration", "30", "--interval", interval]
        assert main([*command, "--quiet", "--no-report", "--out", str(folders[-1])]) == 0
    return folders


def test_a_run_s_own_truth_is_met_between_its_rows(rates):
    """In the field of gravity that there is, to a tenth of a millimetre; tables to the step of their
    times."""
    coarse, fine = (truth.read(folder / "truth").of("soyuz") for folder in rates)
    found = truth.at(fine["t_gps_ns"], coarse)
    assert np.array_equal(found["t_gps_ns"], fine["t_gps_ns"])
    apart_m = np.linalg.norm(found["position_ecef_m"] - fine["position_ecef_m"], axis=1)
    assert apart_m.max() < 1e-4
    assert np.abs(found["velocity_ecef_mps"] - fine["velocity_ecef_mps"]).max() < 1e-4
    table, asked = (polars.read_parquet(folder / "truth.parquet") for folder in rates)
    columns = {name: table[name].to_numpy() for name in trajectory.COLUMNS}
    position, _ = trajectory.of_table(columns, asked["t_gps_s"].to_numpy())
    assert np.linalg.norm(position - fine["position_ecef_m"], axis=1).max() < 3e-3


def test_a_truth_that_does_not_reach_says_so(rates):
    coarse, _ = (truth.read(folder / "truth").of("soyuz") for folder in rates)
    far_ns = coarse["t_gps_ns"][[0, -1]] + np.array([-11, 11]) * S
    assert (truth.at(far_ns, coarse)["t_gps_ns"] != far_ns).all()
