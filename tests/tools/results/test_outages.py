"""Why there is no fix, when, and the figures after convergence."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.contract import codec
from gnss_hil.dbc.contract.values import VALUES, raw_of
from gnss_hil.emulator.truth import TRUTH
from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.results import outages
from gnss_hil.tools.results.summary import build, craft_summary, judge, metric_names
from gnss_hil.tools.results.text import missed, render, unknown

pytestmark = pytest.mark.verifies(
    "tools/results/outages.py",
    what="Reasons and stretches of epochs without a fix",
    by="rows made by hand; fixes and reasons add up to the epochs",
    status="validated",
)

S = 1_000_000_000
CODEC = codec.codec(4)
NO_FIX = raw_of("NoFix")


UNCERTAINTY = (
    *(f"sigma_{v}{a}_{unit}" for v, unit in (("", "m"), ("v", "mps")) for a in "xyz"),
    *(f"rho_{v}{pair}" for v in ("", "v") for pair in ("xy", "xz", "yz")),
    *("clock_bias_m", "clock_domain", "sigma_clock_bias_m"),
)


def fixes(*rows: tuple[int, bool, str]) -> dict:
    """Of (second, valid, reason)."""
    t_s, valid, reason = zip(*rows, strict=True)
    n = len(rows)
    columns = {"t_ns": np.array(t_s) * S, "valid": np.array(valid)}
    columns |= {"no_fix": np.array([NO_FIX.get(r, 12) for r in reason], float)}
    columns |= {f"{a}_m": np.array(t_s, float) for a in "xyz"} | {f"v{a}_mps": np.zeros(n) for a in "xyz"}
    names = (
        "satellites",
        "satellites_used",
        "satellites_paired",
        "measurements",
        "pdop",
        "pdop_distinct",
        "clock_drift_mps",
        *UNCERTAINTY,
    )
    columns |= {name: np.zeros(n) for name in ("tested", "excluded_satellites", "excluded_receivers")}
    columns["excluded"] = np.full(n, "", object)
    return columns | {name: np.full(n, 5.0) for name in names}


class Heard(Digest):
    """A digest of rows instead of frames."""

    def __init__(self, marks_s, rows: dict, measured=0, faults=0):
        super().__init__(CODEC)
        n = len(marks_s)
        self._marks.add({"t_ns": np.array(marks_s) * S, "bits": np.zeros(n, np.int64)})
        columns = {"faults": np.full(n, faults), "satellites_measured": np.full(n, measured)}
        self._marks._pieces[0] |= columns
        self._fixes.add(rows)


def test_every_reason_of_the_contract_is_counted_under_its_name():
    rows = [(k, False, label) for k, label in enumerate(VALUES["NoFix"].values()) if label != "FIX"]
    counted = outages.reasons(fixes(*rows), len(rows))
    assert {r: n for r, n in counted.items() if n} == {label: 1 for _, _, label in rows}


def test_fixes_and_reasons_add_up_to_the_epochs_also_where_nothing_was_said():
    rows = fixes((0, False, "NO_ATTITUDE"), (1, True, "FIX"), (2, False, "FIX"), (3, False, "something new"))
    counted = {r: n for r, n in outages.reasons(rows, 9).items() if n}
    assert counted == {"NO_ATTITUDE": 1, "INCOMPLETE_BLOCK": 1, "UNKNOWN_12": 1, "NOT_REPORTED": 5}
    assert sum(counted.values()) + 1 == 9
    assert outages.reasons({}, 4)["NOT_REPORTED"] == 4


def test_stretches_have_the_reason_of_most_of_their_epochs():
    rows = fixes(
        (0, False, "TOO_FEW_SATELLITES"), (1, False, "TOO_FEW_SATELLITES"), (2, True, "FIX"),
        (3, True, "FIX"), (4, False, "NO_ATTITUDE"), (5, False, "INCONSISTENT_RANGES"),
        (6, False, "INCONSISTENT_RANGES"), (7, True, "FIX"),
    )  # fmt: skip
    found = outages.stretches(np.arange(10) * S, rows, S)
    assert (found.begin_ns // S).tolist() == [0, 4, 8]
    assert found.epochs.tolist() == [2, 3, 2]
    assert found.reason == ("TOO_FEW_SATELLITES", "INCONSISTENT_RANGES", "NOT_REPORTED")
    assert outages.outages(found, 2 * S, S) == {"count": 2, "epochs": 5, "longest_s": 3.0}


def test_lost_time_marks_are_epochs_without_a_fix():
    rows = fixes((0, True, "FIX"), (5, True, "FIX"))
    found = outages.stretches(np.array([0, 5]) * S, rows, S)
    assert (found.begin_ns.tolist(), found.epochs.tolist()) == ([S], [4])


def test_without_a_single_fix_or_mark_there_is_no_outage_but_a_reason():
    never = outages.stretches(np.arange(5) * S, {}, S)
    assert (never.epochs.tolist(), never.reason) == ([5], ("NOT_REPORTED",))
    assert outages.outages(never, None, S)["count"] == 0
    assert len(outages.stretches(np.zeros(0, np.int64), {}, S)) == 0


def cold_start(epochs: int = 200) -> tuple[Heard, np.ndarray]:
    """First fix at 30 s; errors of sqrt(3) * 10 m up to 70 s, then none; an outage of three at 150 s."""
    rows = [
        (k, k >= 30 and not 150 <= k < 153, "FIX" if k >= 30 else "TOO_FEW_SATELLITES") for k in range(epochs)
    ]
    truth = np.zeros(epochs, TRUTH)
    truth["t_gps_ns"] = np.arange(epochs) * S
    truth["velocity_ecef_mps"] = 1.0
    truth["position_ecef_m"] = np.arange(epochs)[:, None] + np.where(np.arange(epochs) < 70, 10, 0)[:, None]
    return Heard(np.arange(epochs), fixes(*rows), measured=2, faults=1), truth


def test_figures_after_convergence_begin_a_stated_time_after_the_first_fix():
    digest, truth = cold_start()
    figures = craft_summary(digest, truth, 200, S)
    settled = figures["converged"]
    assert figures["first_fix_s"] == 30
    assert settled["after_s"] == 30 + outages.CONVERGENCE_S
    assert (settled["epochs"], settled["fixes"]) == (110, 107)
    assert figures["position_error_m"]["max"] == pytest.approx(10 * 3**0.5)
    assert settled["position_error_m"]["max"] == 0
    assert figures["fixes"] + sum(figures["no_fix"].values()) == 200
    assert settled["fixes"] + sum(settled["no_fix"].values()) == settled["epochs"]
    assert figures["without_fix"]["satellites_measured"] == {"mean": 2, "min": 2, "max": 2}
    assert figures["without_fix"]["epochs_with_refused_frames"] == 33


def test_a_run_too_short_to_converge_has_no_such_figure():
    digest, truth = cold_start(60)
    settled = craft_summary(digest, truth, 60, S)["converged"]
    assert (settled["epochs"], settled["fixes"], settled["position_error_m"]["max"]) == (0, 0, None)
    never = craft_summary(Heard(np.arange(9), fixes((0, False, "NO_ATTITUDE"))), np.zeros(0), 9, S)
    assert (never["first_fix_s"], never["converged"]["after_s"], never["converged"]["epochs"]) == (
        None,
        None,
        0,
    )


def facts(expect: dict) -> dict:
    return {
        "scenario": "s", "seed": 1, "policy": "patent", "pace": "lockstep",
        "bus": {"interface": "embedded", "channel": ""}, "reproducible": True, "interrupted": False,
        "duration_s": 200.0, "epoch_interval_s": 1.0, "epochs": 200, "epochs_unanswered": 2,
        "real_time_factor": 1.0, "epoch_latency_ms": {"p50": 1.5, "p99": 3.0}, "frames_sent": None,
        "expect": expect,
    }  # fmt: skip


def test_expectations_from_a_time_on_and_of_the_run():
    digest, truth = cold_start()
    digest.counters.received, digest.counters.lost = 100, 4
    digest.counters.reject("CORRUPTED", 3)
    digest.counters.reject("REPEATED", 2)

    class Kept:
        craft = ("a",)

        def of(self, name):
            return truth

    expect = {
        "a.position_error_m.max": {"max": 1.0, "after_s": 70},
        "a.no_fix.INCOMPLETE_BLOCK": {"max": 0, "after_s": 153},
        "a.first_fix_s": {"max": 29},
        "frames.lost": {"max": 0},
        "frames.rejected": {"max": 5},
        "epochs_unanswered": {"max": 0},
        "epoch_latency_ms.p99": {"max": 3},
    }
    summary = build(facts(expect), {"a": digest}, Kept())
    found = {row["name"]: (row["found"], row["met"]) for row in summary["expectations"]}
    assert found == {
        "a.position_error_m.max": (0, True), "a.no_fix.INCOMPLETE_BLOCK": (0, True),
        "a.first_fix_s": (30, False),
        "frames.lost": (4, False), "frames.rejected": (5, True), "epochs_unanswered": (2, False),
        "epoch_latency_ms.p99": (3, True),
    }  # fmt: skip
    assert missed(summary)[0] == "expectation missed: a.first_fix_s: found 30, expected at most 29"
    text = render(summary)
    assert "a.position_error_m.max from 70 s on at most 1: found 0" in text
    assert "30 TOO_FEW_SATELLITES" in text
    assert "satellites measured there: 2; frames refused in 33 of them" in text
    assert "1 after the first fix, 3 epochs, longest 3 s" in text
    assert "converged, from 90 s" in text


def test_one_is_singular_and_a_range_of_one_value_is_that_value(tmp_path, capsys):
    run = [
        "run",
        "--bus",
        "inline",
        "--duration",
        "1",
        "--no-report",
        "--quiet",
        "--out",
        str(tmp_path / "a"),
    ]
    assert main(run) == 0
    text = capsys.readouterr().out
    assert "00:00:01 in 1 epoch," in text and "0 of 1 epoch (0.0 %)" in text
    assert "(satellites measured there: 0)" in text


def test_without_a_figure_from_then_on_an_expectation_is_missed():
    assert not judge({"a.fixes": {"min": 0, "after_s": 9}}, {"a.fixes": 5})[0]["met"]


def test_names_that_take_after_s_are_figures_of_epochs():
    known, timed = metric_names(["a"], CODEC)
    assert timed < known
    assert {"a.pdop.p95", "a.fixes", "a.no_fix.NO_ATTITUDE", "a.epochs"} <= timed
    assert {"frames.lost", "a.first_fix_s", "a.assignment.commands", "a.converged.fixes"} <= known - timed


def test_a_fix_between_rows_errs_against_the_truth_there_and_far_beyond_them_it_is_not_known():
    """By marks that were wrong: of half a second more, and of forty seconds that truth does not reach."""
    digest, truth = cold_start()
    figures = craft_summary(digest, truth[::2], 200, S)
    assert (figures["errors_unknown"], figures["converged"]["fixes"]) == (0, 107)
    assert figures["converged"]["position_error_m"]["max"] < 1e-9
    digest.fixes["t_ns"][110:113] += S // 2
    assert craft_summary(digest, truth, 200, S)["converged"]["position_error_m"]["max"] == pytest.approx(
        3**0.5 / 2
    )
    figures = craft_summary(digest, truth[:160], 200, S)
    assert figures["errors_unknown"] == figures["converged"]["errors_unknown"] == 30
    assert craft_summary(digest, truth[:0], 200, S)["errors_unknown"] is None
    assert unknown(figures) == "30 fixes, at times that truth does not reach" and not unknown({})


def test_a_mark_that_goes_back_does_not_take_its_fix_out_of_those_after_convergence():
    digest, truth = cold_start()
    digest.fixes["t_ns"][110:113] -= 100 * S
    settled = craft_summary(digest, truth, 200, S)["converged"]
    assert settled["fixes"] == 107 and settled["position_error_m"]["max"] == pytest.approx(90 * 3**0.5)


def test_what_nobody_states_is_no_figure_and_what_no_fix_left_out_does_not_count():
    rows = fixes((0, True, "FIX"), (1, True, "FIX"), (2, False, "INCONSISTENT_RANGES"))
    rows |= {"pdop": np.array([0.0, 3.0, 0.0]), "measurements": np.zeros(3)}
    rows["excluded_satellites"] = np.array([0.0, 2.0, 5.0])
    figures = craft_summary(Heard(range(3), rows), np.zeros(0, TRUTH), 3, S)
    assert figures["pdop"] == {"median": 3, "p95": 3} and set(figures["measurements"].values()) == {None}
    assert figures["excluded"] == {"epochs": 1, "satellites": 2, "receivers": 0}
