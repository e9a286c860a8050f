"""Which figures are better or worse, and which are not judged."""

from __future__ import annotations

import pytest

from gnss_hil.tools.report.comparison.judgement import judged

pytestmark = pytest.mark.verifies(
    "tools/report/comparison/judgement.py",
    what="Figures that are better or worse",
    by="choice of ours",
    status="modelled",
)


@pytest.mark.parametrize(
    ("name", "a", "b", "verdict"),
    [
        ("soyuz.position_error_m.rms", 2.0, 1.0, "better"),
        ("soyuz.converged.pdop.median", 1.0, 2.0, "worse"),
        ("soyuz.fixes", 10, 20, "better"),
        ("soyuz.no_fix.NO_ATTITUDE", 0, 3, "worse"),
        ("frames.rejected.CORRUPTED", 5, 0, "better"),
        ("soyuz.position_error_m.rms", 1.0, 1.004, ""),
        ("soyuz.position_error_m.rms", None, 1.0, ""),
        ("soyuz.assignment.commands", 1, 100, ""),
        ("soyuz.satellites_visible.mean", 1, 100, ""),
    ],
)
def test_better_and_worse(name, a, b, verdict):
    assert judged(name, a, b) == verdict


@pytest.mark.parametrize("name", ["soyuz.fixes", "frames.lost", "soyuz.outages.count"])
def test_counts_of_runs_of_other_length_are_not_judged(name):
    assert judged(name, 1, 100, same_length=False) == ""
    assert judged("soyuz.pdop.median", 1, 100, same_length=False) == "", "another share of it is cold"
    assert judged("soyuz.converged.pdop.median", 1, 100, same_length=False) == "worse"
    assert judged("soyuz.converged.pdop.max", 1, 100, same_length=False) == "", "it grows with the run"


@pytest.mark.parametrize(
    "name",
    ["real_time_factor", "epoch_latency_ms.p99", "mark_late_ms", "bus_load_percent.mean", "duration_s"],
)
def test_what_the_bench_takes_is_not_judged(name):
    assert judged(name, 1, 100) == judged(name, 100, 1) == ""
