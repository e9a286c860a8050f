"""Clocks of single signals by what civil messages say of them: a made-up record."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.emulator.receivers.recorded import inter_signal
from tests.emulator.files.test_rinex_cnav import MIXED_4, SHORT, record

pytestmark = pytest.mark.verifies(
    "emulator/receivers/recorded/inter_signal.py",
    what="Inter-signal corrections by signal",
    by="the speed of light; a record written by the published layout",
    status="validated",
)


def test_metres_by_signal(tmp_path):
    """L1CA, L2C and the pilot of L5, of G01 alone; of what is in no file nothing is known."""
    path = tmp_path / "x.rnx"
    path.write_text(MIXED_4.replace(SHORT, record(1, 1e-9, -2e-9, 3e-9, -4e-9)))
    found = inter_signal.of_files([path])
    assert (found[0, 1], found[4, 1], found[5, 1]) == pytest.approx((0.299792458, -0.599584916, -1.199169832))
    assert np.isfinite(found).sum() == 3
    assert np.isnan(inter_signal.unknown()).all()
