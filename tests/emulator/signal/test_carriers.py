"""Which signals of which satellites receivers can track, and the columns of arrays over them."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites, signals
from gnss_hil.dbc.common.signals import SIGNALS
from gnss_hil.emulator.signal.carriers import carriers

pytestmark = pytest.mark.verifies(
    "emulator/signal/carriers.py",
    what="Signals that receivers can track",
    by="a small table written out by hand",
    status="modelled",
)

VALUE = {name: signal.value for name, signal in SIGNALS.items()}
G1, G2, R1 = (satellites.parse(name) for name in ("G01", "G02", "R01"))


def sent():
    """G01 sends L2C and L5, G02 neither, R01 L2OF; all send their first."""
    out = np.zeros((signals.COUNT, satellites.SATELLITES), bool)
    out[VALUE["L1CA"], [G1, G2]] = out[VALUE["L1OF"], R1] = True
    out[[VALUE["L2C"], VALUE["L5"]], G1] = out[VALUE["L2OF"], R1] = True
    return out


def test_one_signal_of_each_system_leaves_columns_what_rows_are():
    one = carriers(((), ()), sent())
    assert one.ranks == 1 and one.reaches.all()
    assert one.signal[0, :2].tolist() == [VALUE["L1CA"], VALUE["L1OF"]]
    rank, row = one.place(np.array([0, 40]), 48)
    assert rank.tolist() == [0, 0] and row.tolist() == [0, 40]
    assert one.rank_of[VALUE["L2C"]] == -1


def test_others_follow_in_the_tables_order_and_reach_whom_they_are_sent_by_and_built_for():
    both = carriers((("L2C", "L2OF", "L5"), ("L2OF",)), sent())
    assert both.ranks == 3
    assert both.signal[:, 0].tolist() == [VALUE["L1CA"], VALUE["L5"], VALUE["L2C"]], "the table's order"
    assert both.signal[:, 1].tolist() == [VALUE["L1OF"], VALUE["L2OF"], -1]
    wanted = {
        ("L1CA", G1): (True, True), ("L1CA", G2): (True, True), ("L1OF", R1): (True, True),
        ("L2C", G1): (True, False), ("L5", G1): (True, False), ("L2C", G2): (False, False),
        ("L2OF", R1): (True, True), ("L2OF", G1): (False, False), ("L2C", R1): (False, False),
    }  # fmt: skip
    for (name, sat), receivers in wanted.items():
        each = np.array([VALUE[name]] * 2), np.arange(2), np.array([sat] * 2)
        assert both.tracks(*each).tolist() == list(receivers), (name, sat)
    # No third signal of GLONASS reaches anybody.
    assert not both.reaches[2][:, R1].any()
    rank, row = both.place(np.array([5, 48 + 5, 96 + 47]), 48)
    assert rank.tolist() == [0, 1, 2] and row.tolist() == [5, 5, 47]


def test_what_no_emulated_satellite_sends_is_refused_by_name():
    with pytest.raises(
        ValueError, match="signal L2P is sent by no emulated satellite; there are L2C, L5, L2OF"
    ):
        carriers((("L2P",),), sent())
