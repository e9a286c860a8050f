"""Truth as the emulator writes it, read."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.emulator.journal import TruthLog
from gnss_hil.emulator.truth import TRUTH
from gnss_hil.tools.results import truth


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
