"""What a summary says of runs that were not ideal."""

from __future__ import annotations

import re

import numpy as np
import pytest

from gnss_hil.dbc.contract import codec
from gnss_hil.dbc.contract.frames import concat
from gnss_hil.emulator.truth import TRUTH
from gnss_hil.tools.decoder.counters import total
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.results.summary import build, errors_against_truth, judge, metrics, statistics
from gnss_hil.tools.results.text import CLOCK_SAID, render
from tests.support import live_runs
from tests.tools.results.test_outages import UNCERTAINTY

CODEC = codec.codec(4)


def counted(received: int, lost: int) -> Digest:
    """A bus with frames and nothing in them."""
    digest = Digest(CODEC)
    digest.counters.received, digest.counters.lost = received, lost
    return digest


def facts(pace: str | None = "lockstep", unanswered: int | None = 0, sent: int | None = None) -> dict:
    return {
        "scenario": "s", "seed": 1, "policy": "visible", "pace": pace,
        "bus": {"interface": "embedded", "channel": ""}, "reproducible": False, "interrupted": False,
        "duration_s": 100.0, "epoch_interval_s": 1.0, "epochs": 100, "epochs_unanswered": unanswered,
        "real_time_factor": 1.0, "epoch_latency_ms": {"p50": None, "p99": None}, "frames_sent": sent,
    }  # fmt: skip


@pytest.mark.parametrize("sent", [None, 17_300])
def test_where_not_all_senders_declare_the_counters_tell_what_was_sent(sent):
    digests = {"a": counted(18_076, 24)}
    figures = total(d.counters for d in digests.values()).figures(sent)
    assert (figures["sent"], figures["received"], figures["lost"]) == (18_100, 18_076, 24)
    assert "18 076 heard of 18 100 sent, 24 lost" in render(build(facts(sent=sent), digests, None))


def test_what_all_senders_declare_stands():
    figures = total((counted(900, 10).counters, counted(950, 0).counters)).figures(2000)
    assert (figures["sent"], figures["received"], figures["lost"]) == (2000, 1850, 150)


@pytest.mark.parametrize("pace", ["realtime", "x20"])
def test_at_a_free_pace_epochs_are_unanswered_that_have_no_answer_on_record(pace):
    """Whatever bench frames say: who ignores them answers all the same."""
    digest = Digest(CODEC)
    digest.feed(concat([live_runs.epochs()[0][k] for k in range(6)]))
    mute = live_runs.epochs()[0][6]
    digest.feed(mute[[CODEC.sender_of[i] != "FLIGHT" for i in mute.can_id.tolist()]])
    digest.finish()
    summary = build(facts(pace, 100), {"a": digest}, None)
    assert summary["epochs_unanswered"] == 1
    assert "1 without a NAV_STATUS" in render(summary)


def test_of_a_run_that_broke_off_nothing_is_known():
    summary = build(facts(None, 100), {"a": counted(1, 0)}, None)
    assert summary["epochs_unanswered"] is None
    assert "unanswered" not in render(summary)


def test_lockstep_counts_unanswered_epochs():
    summary = build(facts("lockstep", 3), {"a": counted(1, 0)}, None)
    assert summary["epochs_unanswered"] == 3
    assert "3: the run is not reproducible" in render(summary)
    assert "unanswered" not in render(build(facts("lockstep", 0), {"a": counted(1, 0)}, None))


REST = "1 handover, 2 refused by receivers"
OF_A_RECORDING = f"1 300 times again as a recording answers only the commands of then; {REST}"


@pytest.mark.parametrize(
    ("emulator", "repeats", "words"),
    [
        ("ours", 0, f"3 commands, {REST}"),
        ("ours", 7, f"3 commands, sent 7 times again for want of an answer; {REST}"),
        ("replay of runs/a", 1300, f"3 commands, sent {OF_A_RECORDING}"),
    ],
)
def test_commands_that_were_sent_again_say_why(emulator, repeats, words):
    digest = counted(1, 0)
    digest.commands.commands, digest.commands.repeats, digest.commands.rejected = 3, repeats, 2
    digest.commands.handed = [(0, 1, 1, 2)]
    told = render(build(facts() | {"emulator": emulator}, {"a": digest}, None))
    assert re.search(rf"^  assignment +{words}$", told, re.MULTILINE)
    assert ("not ours" in told) is False


@pytest.mark.parametrize(
    ("squared", "said"), [(0.025, True), (0.3, False), (1, False), (4.6, True), (None, False)]
)
def test_a_clock_whose_squared_error_is_far_from_1_is_explained(squared, said):
    summary = build(facts(), {"a": counted(1, 0)}, None)
    settled = summary["craft"]["a"]["converged"]
    settled |= {"after_s": 90, "epochs": 10, "fixes": 10}
    settled["nees"] = {"position": 3, "velocity": 3, "clock": squared}
    assert (CLOCK_SAID in render(summary)) is said


def test_a_run_at_a_pace_says_how_late_its_marks_were():
    late = build(facts("realtime") | {"mark_late_ms": 62.6}, {"a": counted(1, 0)}, None)
    assert late["mark_late_ms"] == 62.6
    assert "62.6 ms at most" in render(late)
    assert "marks late" not in render(
        build(facts("lockstep") | {"mark_late_ms": None}, {"a": counted(1, 0)}, None)
    )


def test_errors_compare_with_the_truth_at_the_time_of_the_fix():
    """Of a row's instant, of one between rows, of one that truth does not reach; and an epoch without a
    fix."""
    s = 1_000_000_000
    rows = np.zeros(2, TRUTH)
    rows["t_gps_ns"] = [10 * s, 20 * s]
    rows["position_ecef_m"], rows["velocity_ecef_mps"] = [[0, 0, 0], [10, 20, 30]], [1, 2, 3]
    fixes = {"t_ns": np.array([20, 15, 99, 10]) * s, "valid": np.array([True, True, True, False])}
    fixes |= {f"{a}_m": np.array([14.0, 9, 9, 9]) for a in "xyz"}
    fixes |= {f"v{a}_mps": np.array([2.0, 2, 9, 9]) for a in "xyz"}
    fixes |= {name: np.full(4, 0.5) for name in UNCERTAINTY}
    found = errors_against_truth(fixes, rows)
    assert found.position_m == pytest.approx([np.sqrt(4**2 + 6**2 + 16**2), np.sqrt(4**2 + 1 + 6**2)])
    assert found.velocity_mps == pytest.approx([2**0.5, 2**0.5])
    assert {name: len(values) for name, values in found.nees.items()} == dict(position=2, velocity=2, clock=2)


def test_statistics_leave_out_what_is_not_there():
    assert statistics([3, np.nan, 4], ("mean", "rms", "max")) == {"mean": 3.5, "rms": 3.535534, "max": 4}
    assert statistics([np.nan], ("mean",)) == {"mean": None}


def test_expectations_are_judged():
    figures = {"soyuz": {"pdop": {"median": 2.0, "p95": None}}}
    assert metrics(figures) == {"soyuz.pdop.median": 2.0, "soyuz.pdop.p95": None}
    limits = {"soyuz.pdop.median": {"min": 2.0, "max": 2.0}, "soyuz.pdop.p95": {"max": 9}}
    assert [row["met"] for row in judge(limits, metrics(figures))] == [True, False]
    assert [row["met"] for row in judge({"soyuz.pdop.median": {"max": 1.9}}, metrics(figures))] == [False]
