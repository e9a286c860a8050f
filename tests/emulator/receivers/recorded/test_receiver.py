"""The truth of a craft that is played: its reference, where that knows."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from gnss_hil.emulator.receivers.recorded.receiver import truth

STATE = SimpleNamespace(pos_ecef_m=np.array((7e6, 0.0, 0.0)), vel_ecef_mps=np.array((0.0, 7e3, 0.0)))


def played(orbit):
    return SimpleNamespace(
        marks_ns=np.array((10, 20)), orbit=orbit, bounds=np.array((0, 2, 3)),
        tracks=SimpleNamespace(sat=np.array((3, 5, 5))),
    )  # fmt: skip


def test_where_the_reference_has_no_state_the_truth_is_unknown():
    orbit = SimpleNamespace(at=lambda t_ns: STATE, holds=lambda t_ns: t_ns == 10)
    here, there, alone = truth(played(orbit), 0), truth(played(orbit), 1), truth(played(None), 0)
    assert here["position_ecef_m"].tolist() == [7e6, 0, 0]
    assert here["velocity_ecef_mps"].tolist() == [0, 7e3, 0]
    for row in (there, alone):
        assert np.isnan(row["position_ecef_m"]).all()
        assert np.isnan(row["velocity_ecef_mps"]).all()
    assert (int(here["satellites_visible"]), int(there["satellites_visible"])) == (2, 1)
