"""What a report draws of channels, against polars on the same table."""

from __future__ import annotations

import numpy as np
import polars
import pytest

from gnss_hil.dbc.common import satellites
from gnss_hil.tools.report.channels import read_channels
from gnss_hil.tools.report.decimate import BUCKETS
from gnss_hil.tools.results import parquet
from gnss_hil.tools.results.parquet import Labelled

pytestmark = pytest.mark.verifies(
    "tools/report/channels.py",
    what="Report: what is drawn of channels",
    by="polars on the same table",
    status="validated",
)
MARKS_NS = np.arange(0, 3 * BUCKETS) * 500_000_000 + 1_035_677_736_000_000_123
INSTANTS = np.array([3, 70, 71, 1000])
AXES = [f"sv_{v}{a}_ecef_m{p}" for v, p in (("", ""), ("v", "ps")) for a in "xyz"]


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """Two craft, three receivers, some strengths unknown, the last receiver silent at first."""
    path = tmp_path_factory.mktemp("channels") / "channels.parquet"
    random = np.random.default_rng(1)
    n = 40_000
    mark = np.sort(random.integers(0, len(MARKS_NS), n))
    receiver = random.integers(1, 4, n)
    receiver[(receiver == 3) & (mark < 2000)] = 1
    names = tuple(satellites.name(i) for i in range(satellites.SATELLITES))
    strength = np.round(random.uniform(20, 50, n) * 4) / 4
    strength[random.random(n) < 0.01] = np.nan
    parquet.write(
        path,
        [
            {"craft": Labelled(random.integers(0, 2, n, np.uint8), ("soyuz", "iss")),
             "t_gps_s": MARKS_NS[mark] / 1e9, "receiver": receiver,
             "satellite": Labelled(random.integers(0, len(names), n, np.uint16), names),
             "signal": Labelled(random.integers(0, 3, n, np.uint8), ("L1CA", "L2C", "L1OF")),
             "used": random.random(n) < 0.5, "pseudorange_m": random.uniform(2e7, 3e7, n),
             "sv_clock_m": random.uniform(-1e5, 1e5, n), "cn0_dbhz": strength,
             **{axis: random.uniform(-3e7, 3e7, n) for axis in AXES}}
        ],
    )  # fmt: skip
    return path


@pytest.fixture(scope="module")
def ours(table):
    return read_channels(table, "iss", MARKS_NS, INSTANTS)


@pytest.fixture(scope="module")
def theirs(table):
    return polars.read_parquet(table).filter(craft="iss")


def test_what_each_receiver_tracked(ours, theirs):
    for receiver in (1, 2, 3):
        t_ns, by, satellite = ours.tracked(receiver)
        rows = theirs.filter(receiver=receiver)
        assert (t_ns / 1e9).tolist() == rows["t_gps_s"].to_list()
        assert set(by.tolist()) == {receiver}
        assert [satellites.name(i) for i in satellite.tolist()] == rows["satellite"].to_list()


def test_strength_keeps_the_least_and_the_greatest(ours, theirs):
    found = ours.strength(3)
    since = (polars.col("t_gps_s") - MARKS_NS[0] / 1e9) * 1e9
    width = (MARKS_NS[-1] - MARKS_NS[0]) / (BUCKETS - 1)
    for receiver in (1, 2, 3):
        value = polars.col("cn0_dbhz")
        rows = (
            theirs.filter(receiver=receiver)
            .group_by((since.round() / width).floor().alias("bucket"))
            .agg(polars.col("t_gps_s").min(), value.min().alias("least"), value.mean().alias("mean"),
                 value.max().alias("greatest"))
            .sort("bucket")
        )  # fmt: skip
        strength = found[receiver]
        assert (strength.t_ns / 1e9).tolist() == rows["t_gps_s"].to_list()
        for name in ("least", "mean", "greatest"):
            np.testing.assert_allclose(
                getattr(strength, name), rows[name].to_numpy(), rtol=1e-12, err_msg=name
            )


def test_places_at_the_instants_looked_at(ours, theirs):
    rows = theirs.filter(polars.col("t_gps_s").is_in((MARKS_NS[INSTANTS] / 1e9).tolist()))
    assert len(rows) > 10
    assert (ours.seen.t_ns / 1e9).tolist() == rows["t_gps_s"].to_list()
    assert ours.seen_by.tolist() == rows["receiver"].to_list()
    vectors = np.hstack([ours.seen.position_m, ours.seen.velocity_mps])
    assert vectors.tolist() == [list(row) for row in rows.select(AXES).rows()]


def test_a_craft_without_a_measurement(table):
    nothing = read_channels(table, "station", MARKS_NS, INSTANTS)
    assert len(nothing.mark) == 0
    assert len(nothing.seen.t_ns) == 0
    assert [len(s.t_ns) for s in nothing.strength(2).values()] == [0, 0]


def test_ranges_are_those_of_first_signals_at_marks_spread_over_the_run(ours, theirs):
    marks = np.unique(ours.ranges.mark)
    assert ours.looked_at == 1500 < len(MARKS_NS) and np.diff(marks).max() <= 3 * len(MARKS_NS) / 1500
    rows = theirs.filter(
        polars.col("t_gps_s").is_in((MARKS_NS[marks] / 1e9).tolist()), polars.col("signal") != "L2C"
    )
    assert len(rows) == len(ours.ranges.mark) > 1000
    assert ours.ranges.corrected_m == pytest.approx((rows["pseudorange_m"] + rows["sv_clock_m"]).to_numpy())
    assert ours.ranges.used.tolist() == rows["used"].to_list()
    assert ours.ranges.place_m == pytest.approx(rows.select(AXES[:3]).to_numpy())


def test_satellites_of_a_receiver_are_counted_once_where_it_has_several_signals(ours, theirs):
    mine = theirs.filter(receiver=2).group_by("t_gps_s")
    at = np.searchsorted(MARKS_NS / 1e9, mine.len()["t_gps_s"].to_numpy())
    assert ours.satellites_of(2, several_signals=False).sum() == ours.satellites_of(2, False)[at].sum()
    for several, counted in ((False, mine.len()["len"]), (True, mine.n_unique()["satellite"])):
        assert ours.satellites_of(2, several).sum() == counted.sum()
