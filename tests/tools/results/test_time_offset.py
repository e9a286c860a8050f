"""A truth of another time: orbits in closed form, and a run whose truth was moved."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from gnss_hil.emulator.truth import TRUTH as ROW
from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.recording.run_folder import SUMMARY, TRUTH
from gnss_hil.tools.results import time_offset

pytestmark = pytest.mark.verifies(
    "tools/results/time_offset.py",
    what="Truth and fixes of two time systems",
    by="a circle in closed form; a run whose truth was moved by 15 s",
    status="validated",
)

R_M, RATE = 6.8e6, 2 * np.pi / 5580


def circle(t_s):
    angle = RATE * t_s
    place = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    return R_M * place, R_M * RATE * np.column_stack([-np.sin(angle), np.cos(angle), 0 * angle])


def remarks(offset_s, off_m=0.0, known=200, speed=1.0):
    """Of fixes at t and truth that was there at t - offset_s; its velocity is known of so many epochs from
    the end."""
    t_s = np.arange(200.0)
    rows = np.zeros(200, ROW)
    rows["t_gps_ns"] = t_s * 1e9
    rows["position_ecef_m"], velocity = circle(t_s - offset_s)
    rows["velocity_ecef_mps"] = speed * velocity
    rows["velocity_ecef_mps"][: 200 - known] = np.nan
    place, _ = circle(t_s)
    fixes = {"t_ns": rows["t_gps_ns"].copy(), "valid": t_s > 50}
    fixes |= {f"{a}_m": place[:, k] + (off_m if a == "z" else 0.0) for k, a in enumerate("xyz")}
    return [*time_offset.remark("b", fixes, rows)]


@pytest.mark.parametrize(
    ("offset_s", "said"), [(15.0, "15 s earlier"), (-18.0, "18 s later"), (0.01, "0.01 s earlier")]
)
def test_an_interval_of_time_is_named(offset_s, said):
    (line,) = remarks(offset_s)
    assert said in line
    found_m, left_m = map(int, re.findall(r"(\d+) m", line)[:2])
    assert found_m == pytest.approx(2 * R_M * np.sin(RATE * abs(offset_s) / 2), abs=1)
    assert left_m <= R_M * (RATE * offset_s) ** 2 / 2 + 1


@pytest.mark.parametrize("given", [{"offset_s": 0.0}, {"offset_s": 0.0, "off_m": 5e3},
                                   {"offset_s": 0.005}, {"offset_s": 15.0, "known": 0}])  # fmt: skip
def test_other_errors_are_no_matter_of_time(given):
    assert remarks(**given) == []


def test_epochs_whose_velocity_is_unknown_do_not_hide_it():
    assert "15 s earlier" in remarks(15.0, known=100)[0]


@pytest.mark.filterwarnings("error")
def test_a_truth_that_stands_still_has_no_time_to_be_off_by():
    assert remarks(15.0, speed=0.0) == []


def test_a_run_is_told_of_it(tmp_path, capsys):
    run = tmp_path / "run"
    words = [
        "run",
        "soyuz",
        "--bus",
        "inline",
        "--duration",
        "70",
        "--quiet",
        "--no-report",
        "--out",
        str(run),
    ]
    assert main(words) == 0
    assert "time system" not in capsys.readouterr().err
    head, _, rows = (run / TRUTH).read_bytes().partition(b"\n")
    moved = np.frombuffer(rows, ROW).copy()
    moved["t_gps_ns"] += 15 * 10**9
    (run / TRUTH).write_bytes(head + b"\n" + moved.tobytes())
    assert main(["report", str(run)]) == 0
    assert " 15 s earlier: are they of one time system?" in capsys.readouterr().err
    assert len(json.loads((run / SUMMARY).read_bytes())["remarks"]) == 2
