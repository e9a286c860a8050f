"""Almanac frames of a bus, as the report keeps them."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import batch, concat
from gnss_hil.tools.decoder.almanac import AlmanacLog
from gnss_hil.tools.decoder.block import Block, of_frames

pytestmark = pytest.mark.verifies(
    "tools/decoder/almanac.py",
    "tools/decoder/digest.py",
    what="Tables of a run: almanac as told, clocks as shown",
    by="values put in come out; what is kept is our choice",
    status="modelled",
)

CODEC = codec(4)


def heard(rows_of: dict[str, list[tuple[int, int, int]]], epochs: int = 100) -> Block:
    """Kind -> rows of (epoch, receiver, satellite number), which is its x [10 km] too."""
    parts, row = [], []
    for kind, rows in rows_of.items():
        for epoch, receiver, number in rows:
            values = {"sat_system": 0, "sat_number": number}
            values |= {"x_m": 1e4 * number} if kind == "ALM_XY" else {}
            parts.append(batch(CODEC.can_id_of[kind, receiver], CODEC.encode(kind, values)))
            row.append(epoch)
    return of_frames(CODEC, concat(parts), np.array(row), epochs)


def all_three(rows):
    return heard(dict.fromkeys(("ALM_XY", "ALM_Z", "ALM_V"), rows))


def kept(log: AlmanacLog) -> list[tuple[int, int, float]]:
    rows = log.rows
    return list(
        zip(
            (rows["t_ns"] // NS_PER_S).tolist(),
            rows["sat"].tolist(),
            (rows["x_m"] / 1e4).tolist(),
            strict=True,
        )
    )


def test_a_prediction_counts_when_its_three_frames_came_from_one_receiver_in_one_epoch():
    log = AlmanacLog()
    log.take(
        np.array([60, 61]) * NS_PER_S,
        heard({
            "ALM_XY": [(0, 1, 5), (0, 1, 6), (0, 1, 7)],
            "ALM_Z": [(0, 1, 5), (0, 2, 6), (0, 1, 7)],
            "ALM_V": [(0, 1, 5), (0, 1, 6), (1, 1, 7)],
        }),
    )  # fmt: skip
    assert kept(log) == [(60, 5, 5.0)]


def test_one_prediction_a_satellite_and_minute_is_kept_whatever_the_pieces():
    t_s = np.arange(0, 200, 20)
    whole, pieces = AlmanacLog(), AlmanacLog()
    whole.take(t_s * NS_PER_S, all_three([(e, 1, 3) for e in range(len(t_s))]))
    for t in t_s:
        pieces.take(np.array([t]) * NS_PER_S, all_three([(0, 1, 3)]))
    assert kept(whole) == kept(pieces) == [(0, 3, 3.0), (60, 3, 3.0), (120, 3, 3.0), (180, 3, 3.0)]


def test_an_epoch_without_a_time_is_left_out_and_none_is_empty():
    log = AlmanacLog()
    log.take(np.array([-1]), all_three([(0, 1, 3)]))
    assert log.rows == {}
