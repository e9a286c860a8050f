"""Orbits of the craft: messages and tables read by other people's packages."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.emulator.files import sp3 as reader
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.export import oem as ours
from gnss_hil.tools.export import sp3, time_series
from gnss_hil.tools.export.time_series import TimeSeries
from tests.support.outside import peer

pytestmark = pytest.mark.verifies(
    "tools/export/oem.py",
    "tools/export/sp3.py",
    "tools/export/time_series.py",
    what="Exported OEM and SP3 files",
    by="read by the Python packages oem and sp3; RTKLIB interpolates the table of satellites",
    status="validated",
)


@pytest.fixture(scope="module")
def fixes(decoded) -> TimeSeries:
    (course_of_craft,) = time_series.of_fixes([decoded[1]])
    return course_of_craft


def test_the_package_oem_reads_the_message(fixes, tmp_path):
    oem = peer("oem")
    path = tmp_path / "soyuz.oem"
    path.write_text("".join(ours.text_of(fixes)))
    message = oem.OrbitEphemerisMessage.open(str(path))
    states = [state for segment in message.segments for state in segment.states]
    assert len(states) == len(fixes.t_ns)
    # GPS - UTC was 16 s in October 2012 (IERS Bulletin C 43).
    assert states[0].epoch.utc.datetime.isoformat() == "2012-10-31T00:15:20"
    for got, wanted, unit in (
        ([s.position for s in states], fixes.position_m, 1e3),
        ([s.velocity for s in states], fixes.velocity_mps, 1e3),
    ):
        assert np.abs(np.array(got) * unit - wanted).max() < 1e-3


def test_a_gap_ends_a_segment(fixes):
    keep = np.r_[0:10, 20:30]
    holed = TimeSeries("soyuz", fixes.t_ns[keep], fixes.position_m[keep], fixes.velocity_mps[keep], "fixes")
    assert "".join(ours.text_of(holed)).count("META_START") == 2
    assert "".join(ours.text_of(fixes)).count("META_START") == 1


def test_a_craft_without_velocities_has_no_message(fixes):
    still = TimeSeries("soyuz", fixes.t_ns, fixes.position_m, np.full_like(fixes.position_m, np.nan), "fixes")
    with pytest.raises(Mistake, match="no position with a velocity"):
        "".join(ours.text_of(still))


@pytest.mark.slow
def test_the_package_sp3_reads_the_table(fixes, tmp_path):
    package = peer("sp3")
    path = tmp_path / "one.sp3"
    path.write_text("".join(sp3.text_of(sp3.of_craft([fixes]))))
    (satellite,) = package.Product.from_file(path).satellites
    assert satellite.id == b"L01"
    assert len(satellite.records) == len(fixes.t_ns)
    assert np.abs(np.array([r.position for r in satellite.records]) - fixes.position_m).max() <= 0.6e-3
    assert np.abs(np.array([r.velocity for r in satellite.records]) - fixes.velocity_mps).max() < 1e-6


def test_a_craft_that_is_away_has_zeros(fixes):
    later = TimeSeries("other", fixes.t_ns[5:], fixes.position_m[5:], fixes.velocity_mps[5:], "fixes")
    read = reader.parse("".join(sp3.text_of(sp3.of_craft([fixes, later]))), "written")
    assert read.name == ("L01", "L02")
    assert read.t_ns.tolist() == fixes.t_ns.tolist()
    assert np.isnan(read.pos_ecef_m[:5, 1]).all() and not np.isnan(read.pos_ecef_m[5:]).any()
    assert np.isnan(read.clock_s).all()


def test_uneven_epochs_make_no_table(fixes):
    t_ns = fixes.t_ns[:3] + np.array((0, 0, 300_000_000))
    uneven = TimeSeries("soyuz", t_ns, fixes.position_m[:3], fixes.velocity_mps[:3], "fixes")
    with pytest.raises(Mistake, match="not evenly spaced"):
        sp3.of_craft([uneven])


def test_truth_is_where_the_craft_was(run, decoded, fixes):
    (true,) = time_series.of_truth(run, [decoded[1]])
    rows = np.searchsorted(true.t_ns, fixes.t_ns)
    assert len(true.t_ns) == 90
    assert np.abs(true.position_m[rows] - fixes.position_m).max() < 0.01
