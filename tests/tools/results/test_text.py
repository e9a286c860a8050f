"""TOML, truth, expectations, budget, progress: the small parts of the report."""

from __future__ import annotations

import io
import tomllib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss_hil.dbc.common import vehicle
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.bits import frame_bits
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import EMPTY, batch
from gnss_hil.emulator.config import scenario as scenarios
from gnss_hil.emulator.journal import TruthLog
from gnss_hil.emulator.truth import TRUTH
from gnss_hil.tools.common import toml
from gnss_hil.tools.common.durations import clock
from gnss_hil.tools.live.progress import Progress
from gnss_hil.tools.results import truth
from gnss_hil.tools.results.summary import errors_against_truth, judge, metrics, statistics
from gnss_hil.tools.run_config.frame_budget import WORST_BITS, budget, typical_bits
from gnss_hil.tools.run_config.plan import make
from tests.tools.results.test_outages import UNCERTAINTY

CODEC = codec(4)
NAMES = st.text(st.characters(codec="utf-8"), min_size=1, max_size=8)
VALUES = st.recursive(
    st.booleans() | st.integers(-(2**62), 2**62) | st.floats(allow_nan=False, allow_infinity=False) | NAMES,
    lambda v: st.lists(v, max_size=3) | st.dictionaries(NAMES, v, max_size=3),
    max_leaves=12,
)


@pytest.mark.verifies(
    "tools/common/toml.py",
    what="Resolved scenarios as TOML",
    by="Python's tomllib reads any document back, by hypothesis",
    status="validated",
)
@given(st.dictionaries(NAMES, VALUES, max_size=4))
def test_toml_reads_back_what_was_written(document):
    assert tomllib.loads(toml.dumps(document)) == document


@pytest.mark.parametrize("name", scenarios.shipped())
def test_a_resolved_scenario_is_the_same_scenario(name):
    path = scenarios.shipped()[name]
    scenario = scenarios.parse(scenarios.read(path), str(path))
    again = tomllib.loads(toml.dumps(scenario.model_dump(mode="json", exclude_none=True)))
    assert scenarios.parse(again, "again") == scenario


@pytest.mark.verifies(
    "emulator/truth.py",
    "emulator/journal.py",
    "tools/results/truth.py",
    what="Truth and status, as streams",
    by="formats of our own, written by one side and read by the other",
    status="modelled",
)
def test_truth_reads_what_the_emulator_wrote_and_leaves_out_a_cut_row(tmp_path):
    rows = np.zeros(3, TRUTH)
    rows["t_gps_ns"], rows["craft"] = [1, 2, 3], [0, 1, 0]
    with TruthLog(tmp_path / "truth", TRUTH, ["a", "b"]) as log:
        log.add(rows, 0.0)
    whole = truth.read(tmp_path / "truth")
    assert whole.craft == ("a", "b")
    assert whole.of("a")["t_gps_ns"].tolist() == [1, 3]
    (tmp_path / "cut").write_bytes((tmp_path / "truth").read_bytes()[:-5])
    assert len(truth.read(tmp_path / "cut").rows) == 2


def test_a_file_that_is_no_truth_is_told(tmp_path):
    (tmp_path / "truth").write_text("hello")
    with pytest.raises(truth.TruthError, match="not a truth file"):
        truth.read(tmp_path / "truth")


def test_errors_compare_equal_instants_only():
    rows = np.zeros(2, TRUTH)
    rows["t_gps_ns"] = [10, 20]
    rows["position_ecef_m"] = [[0, 0, 0], [1, 2, 3]]
    fixes = {"t_ns": np.array([20, 15, 10]), "valid": np.array([True, True, False])}
    fixes |= {f"{a}_m": np.array([4.0, 9, 9]) for a in "xyz"} | {
        f"v{a}_mps": np.array([0.0, 9, 9]) for a in "xyz"
    }
    fixes |= {name: np.full(3, 0.5) for name in UNCERTAINTY}
    found = errors_against_truth(fixes, rows)
    assert found.position_m == pytest.approx([np.sqrt(3**2 + 2**2 + 1)])
    assert found.velocity_mps.tolist() == [0]
    assert {name: len(values) for name, values in found.nees.items()} == dict(position=1, velocity=1, clock=1)


def test_statistics_leave_out_what_is_not_there():
    assert statistics([3, np.nan, 4], ("mean", "rms", "max")) == {"mean": 3.5, "rms": 3.535534, "max": 4}
    assert statistics([np.nan], ("mean",)) == {"mean": None}


def test_expectations_are_judged():
    figures = {"soyuz": {"pdop": {"median": 2.0, "p95": None}}}
    assert metrics(figures) == {"soyuz.pdop.median": 2.0, "soyuz.pdop.p95": None}
    limits = {"soyuz.pdop.median": {"min": 2.0, "max": 2.0}, "soyuz.pdop.p95": {"max": 9}}
    assert [row["met"] for row in judge(limits, metrics(figures))] == [True, False]
    assert [row["met"] for row in judge({"soyuz.pdop.median": {"max": 1.9}}, metrics(figures))] == [False]


@pytest.mark.verifies(
    "tools/run_config/frame_budget.py",
    what="Frame budget",
    by="135 bits at most (Nolte et al., 2001); no epoch of a run has more frames or bits than foreseen",
    status="validated",
)
def test_worst_frame_is_the_worst_there_is():
    """Five equal bits, then alternating fours: the published worst case of 24 stuff bits (Nolte et al., 2001:
    an 8-byte base frame has at most 135 bits with intermission)."""
    assert WORST_BITS == 135
    draw = np.random.default_rng(1)
    random = batch(draw.integers(0, 0x800, 5000), draw.integers(0, 256, (5000, 8)))
    pattern = batch(np.full(256, 0x078), np.tile(np.arange(256)[:, None], 8))
    assert frame_bits(random).max() <= WORST_BITS
    assert WORST_BITS - 4 <= frame_bits(pattern).max() <= WORST_BITS
    assert 111 < typical_bits() < WORST_BITS


def test_budget_refuses_above_the_limit_with_the_numbers():
    craft = vehicle.load(vehicle.find("soyuz-ms"))
    fits, full = (budget(craft, interval_s, 54, 20.0) for interval_s in (1.0, 0.05))
    assert fits.refusal("soyuz") is None
    assert fits.worst_percent == pytest.approx(100 * fits.frames(True) * 135 / 1e6)
    assert "soyuz: the bus would overflow" in full.refusal("soyuz")
    assert f"{full.worst_percent:.0f} %" in full.refusal("soyuz")


def test_progress_is_one_line_on_a_terminal_and_plain_in_a_pipe():
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    said = CODEC.encode("NAV_STATUS", {"mode": 2, "satellites": 24, "pdop": 0.81})
    frames, _ = e2e.protect(
        CODEC, batch(CODEC.can_id_of["NAV_STATUS", 0], said), e2e.fresh_counters(CODEC), epoch=59
    )
    for stream, returns in ((Terminal(), 1), (io.StringIO(), 0)):
        Progress(make("soyuz"), stream)._show(59, frames)
        assert stream.getvalue().count("\r") == returns
        assert "00:01:00 of 00:10:00   10 %" in stream.getvalue()
        assert "24 satellites  PDOP 0.81" in stream.getvalue()
    assert clock(90061) == "1 d 01:01:01"


def test_the_last_line_of_progress_in_a_pipe_is_the_end():
    for shown, lines in ((False, 0), (True, 2)):
        stream = io.StringIO()
        progress = Progress(make("soyuz"), stream)
        if shown:
            progress._show(509, EMPTY)
        progress.hear(0, 599, EMPTY)
        progress.close()
        progress.close()
        said = stream.getvalue().splitlines()
        assert len(said) == lines, "a run too short for a line of progress has none"
        assert not lines or "00:10:00 of 00:10:00  100 %" in said[-1]
