"""Reader of the Earth's orientation: published lines, and what is wrong with a broken file."""

from __future__ import annotations

from datetime import datetime

import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.files import finals
from gnss_hil.emulator.files.text import FileError

pytestmark = pytest.mark.verifies(
    what="Measured orientation of the Earth, from file to flown orbit and attitude",
)

# finals2000A.all of the IERS, three days of 2011, to the end of bulletin A's columns for UT1.
TEXT = """\
11 5 2 55683.00 I -0.043247 0.000036  0.344046 0.000028  I-0.2458739 0.0000066  0.9811 0.0052
11 5 3 55684.00 I -0.042714 0.000024  0.346773 0.000026  I-0.2468430 0.0000082  0.9029 0.0051
11 5 4 55685.00 I -0.042392 0.000028  0.349110 0.000026  I-0.2476898 0.0000077  0.8551 0.0056
"""
ARCSEC = np.pi / 648_000


def test_columns_are_the_published_ones():
    read = finals.parse(TEXT, "f")
    assert read.t_ns[1] == gpstime.from_utc(datetime(2011, 5, 3))
    ut1_gps_s, pole_rad = read.at(read.t_ns[1:2])
    assert ut1_gps_s == pytest.approx([-0.2468430 - 15])
    assert pole_rad / ARCSEC == pytest.approx(np.array([[-0.042714, 0.346773]]))


def test_between_days_it_is_linear():
    read = finals.parse(TEXT, "f")
    ut1_gps_s, pole_rad = read.at(np.array(gpstime.from_utc(datetime(2011, 5, 3, 12))))
    assert ut1_gps_s == pytest.approx((-0.2468430 - 0.2476898) / 2 - 15)
    assert pole_rad[1] / ARCSEC == pytest.approx((0.346773 + 0.349110) / 2)


def test_ut1_minus_gps_does_not_jump_at_a_leap_second():
    """1 January 2017: UT1 - UTC went from -0.408 s to +0.591 s (IERS Bulletin A)."""
    lines = [
        "161231 57753.00 I  0.080034 0.000091  0.266150 0.000090  I-0.4076460 0.0000102",
        "17 1 1 57754.00 I  0.078570 0.000091  0.267400 0.000090  I 0.5912845 0.0000102",
    ]
    step_s = np.diff(finals.parse("\n".join(lines), "f").ut1_gps_s)
    assert abs(step_s[0]) < 3e-3


def test_days_without_values_end_the_table():
    assert len(finals.parse(TEXT + "11 5 5 55686.00\n11 5 6 55687.00\n", "f").t_ns) == 3


@pytest.mark.parametrize(
    "old, new, message",
    [
        ("-0.042714", "-0.04x714", r"line 2: PM-x is '-0.04x714'; a number from -2 to 2 in columns 19-27"),
        ("-0.2468430", "99.2468430", r"line 2: UT1-UTC is '99.2468430'"),
        ("55684.00", "55682.00", r"line 2: MJD is 55682, after 55683"),
        ("55685.00", "     nan", r"line 3: MJD is 'nan'"),
    ],
)
def test_a_fault_is_reported_in_one_line(old, new, message):
    with pytest.raises(FileError, match=f"^f: {message}") as caught:
        finals.parse(TEXT.replace(old, new), "f")
    assert "\n" not in str(caught.value)


def test_another_files_text_and_runs_beyond_the_table_are_refused():
    with pytest.raises(FileError, match="0 days with UT1-UTC"):
        finals.parse("hello\n", "f")
    read = finals.parse(TEXT, "f")
    first, last = int(read.t_ns[0]), int(read.t_ns[-1])
    read.check(first, last)
    message = r"^f: the Earth's orientation from 2011-05-02T00:00:15 to 2011-05-04T00:00:15; the run is from"
    for begin_ns, end_ns in ((first - 1, last), (first, last + 1)):
        with pytest.raises(FileError, match=message):
            read.check(begin_ns, end_ns)


def test_beyond_the_table_its_ends_hold():
    """A trajectory's states may go on behind its run, and there need some orientation."""
    read = finals.parse(TEXT, "f")
    ut1_gps_s, pole_rad = read.at(read.t_ns[[0, -1]] + np.array((-1, 1)) * 10**12)
    assert ut1_gps_s.tolist() == read.ut1_gps_s[[0, -1]].tolist()
    assert pole_rad.tolist() == read.pole_rad[[0, -1]].tolist()


def test_a_run_where_days_are_missing_is_refused():
    lines = TEXT.splitlines(True)
    later = lines[2].replace("11 5 4 55685.00", "11 5 9 55690.00")
    read = finals.parse("".join((*lines[:2], later)), "f")
    read.check(int(read.t_ns[0]), int(read.t_ns[1]) - 1)
    for begin_ns in (int(read.t_ns[0]), int(read.t_ns[1]), int(read.t_ns[1]) + 10**12):
        with pytest.raises(
            FileError, match=r"^f: no day between 2011-05-03 and 2011-05-09, in which the run is"
        ):
            read.check(begin_ns, int(read.t_ns[2]) - 1)


def test_predicted_days_are_noted():
    assert finals.parse(TEXT, "f").measured_ns is None
    lines = TEXT.splitlines(True)
    predicted = [line[:57] + "P" + line[58:] for line in lines]
    found = finals.parse("".join((lines[0], *predicted[1:])), "f")
    assert found.measured_ns == found.t_ns[0]
    pole_alone = [line[:16] + "P" + line[17:] for line in lines]
    assert finals.parse("".join(pole_alone), "f").measured_ns is None


def test_blank_lines_are_no_days():
    found = finals.parse("\n" + TEXT.replace("\n", "\n\n"), "f")
    assert np.array_equal(found.t_ns, finals.parse(TEXT, "f").t_ns)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("-0.2468430", " 0.0000000", "UT1 moves by 0.25 s; it never does by more than 0.01 s a day"),
        ("-0.2468430", " 0.9999999", "UT1 moves by 1.2 s"),
        ("-0.042714", " 0.000000", "the pole moves by 2.1e-07 rad"),
        (" 0.346773", " 0.000000", "the pole moves by 1.7e-06 rad"),
    ],
)
def test_a_day_that_the_earth_never_had_is_refused_where_a_run_is(old, new, said):
    assert old in TEXT
    read, whole = finals.parse(TEXT.replace(old, new), "f"), finals.parse(TEXT, "f")
    inside = int(whole.t_ns[1]) + 3600 * 10**9
    whole.check(inside, inside)
    with pytest.raises(FileError, match=f"f: to 2011-05-0[34] {said}"):
        read.check(inside, inside)
