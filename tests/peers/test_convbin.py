"""RTKLIB's reader and ours on the same real file: what it writes as RINEX 3 must read as what we read."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest

from gnss_hil.emulator.files import rinex_obs
from gnss_hil.emulator.files.text import read_text
from tests.support.outside import data_file, program
from tests.support.waiting import HANG_S

pytestmark = [
    pytest.mark.realdata,
    pytest.mark.verifies(what="Observation files"),
]

SAME = {"C1W": "P1", "C2W": "P2", "L1W": "L1", "L2W": "L2"}
"""RTKLIB keeps the P code of each band, and names it as version 3 does."""


def test_a_day_of_grace_through_convbin(tmp_path):
    tool = program("convbin", "rtklib", "RTKLIB")
    path = data_file("grace_b_2010-07-27/GRCB2080.10D.gz")
    plain, converted = tmp_path / "grcb2080.10o", tmp_path / "converted.rnx"
    plain.write_text(read_text(path))
    command = [tool, "-r", "rinex", "-v", "3.04", "-o", str(converted), str(plain)]
    subprocess.run(command, capture_output=True, timeout=HANG_S, check=True)
    ours, theirs = rinex_obs.read(path), rinex_obs.read(converted)
    assert np.array_equal(ours.t_ns, theirs.t_ns)
    assert np.array_equal(ours.epoch, theirs.epoch)
    assert np.array_equal(ours.sat, theirs.sat)
    for name, before in SAME.items():
        assert np.array_equal(theirs.obs[name], ours.obs[before]), name
    lost = {name: int((theirs.lli[name] & 1 != ours.lli[before] & 1).sum()) for name, before in SAME.items()}
    print(f"{len(ours.sat)} rows, {len(SAME)} observables each, equal to the last digit; loss of lock {lost}")
    # RTKLIB adds a loss of lock to the first epoch alone.
    assert max(lost.values()) <= np.count_nonzero(ours.epoch == 0)
