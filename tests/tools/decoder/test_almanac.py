"""Almanac frames of a bus, as the report keeps them."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.tools.decoder.almanac import AlmanacLedger


def heard(epochs: dict[str, list[tuple[int, int, int]]]):
    """Decoded frames: kind -> rows of (epoch, receiver, satellite number), which is its x [m] too."""

    def kinds(kind: str):
        rows = np.array(epochs.get(kind, []), np.int64).reshape(-1, 3)
        zero = np.zeros(len(rows))
        signals = dict.fromkeys(("x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps", "health"), zero)
        signals |= {"sat_system": zero.astype(np.int64), "sat_number": rows[:, 2], "x_m": rows[:, 2] * 1.0}
        return rows[:, 0], rows[:, 1], signals

    return kinds


def all_three(rows):
    return heard(dict.fromkeys(("ALM_XY", "ALM_Z", "ALM_V"), rows))


def kept(ledger: AlmanacLedger) -> list[tuple[int, int, float]]:
    rows = ledger.rows
    return list(
        zip((rows["t_ns"] // NS_PER_S).tolist(), rows["sat"].tolist(), rows["x_m"].tolist(), strict=True)
    )


def test_a_prediction_counts_when_its_three_frames_came_from_one_receiver_in_one_epoch():
    ledger = AlmanacLedger()
    ledger.take(
        np.array([60, 61]) * NS_PER_S,
        heard({
            "ALM_XY": [(0, 1, 5), (0, 1, 6), (0, 1, 7)],
            "ALM_Z": [(0, 1, 5), (0, 2, 6), (0, 1, 7)],
            "ALM_V": [(0, 1, 5), (0, 1, 6), (1, 1, 7)],
        }),
    )  # fmt: skip
    assert kept(ledger) == [(60, 5, 5.0)]


def test_one_prediction_a_satellite_and_minute_is_kept_whatever_the_pieces():
    t_s = np.arange(0, 200, 20)
    whole, pieces = AlmanacLedger(), AlmanacLedger()
    whole.take(t_s * NS_PER_S, all_three([(e, 1, 3) for e in range(len(t_s))]))
    for t in t_s:
        pieces.take(np.array([t]) * NS_PER_S, all_three([(0, 1, 3)]))
    assert kept(whole) == kept(pieces) == [(0, 3, 3.0), (60, 3, 3.0), (120, 3, 3.0), (180, 3, 3.0)]


def test_an_epoch_without_a_time_is_left_out_and_none_is_empty():
    ledger = AlmanacLedger()
    ledger.take(np.array([-1]), all_three([(0, 1, 3)]))
    assert ledger.rows == {}
