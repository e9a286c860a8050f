"""Almanacs: numbers as the files have them, weeks by the date, and faults in one line."""

from datetime import datetime

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.emulator.files import almanacs
from gnss_hil.emulator.files.text import FileError

pytestmark = pytest.mark.verifies(what="Almanac files (YUMA, SEM, AGL)")

# PRN 1 as the US Coast Guard published it for 2016-04-02 and 2016-03-02.
YUMA = """******** Week 866 almanac for PRN-01 ********
ID:                         01
Health:                     000
Eccentricity:               0.5221366882E-002
Time of Applicability(s):  589824.0000
Orbital Inclination(rad):   0.9637857480
Rate of Right Ascen(r/s):  -0.7897471819E-008
SQRT(A)  (m 1/2):           5153.602051
Right Ascen at Week(rad):  -0.1159458779E+001
Argument of Perigee(rad):   0.451712027
Mean Anom(rad):            -0.2105941778E+001
Af0(s):                     0.1621246338E-004
Af1(s/s):                   0.0000000000E+000
week:                        866
"""
SEM = """ 1  CURRENT.ALM
 862 319488

1
63
0
 5.10072708129883E-03  6.84547424316406E-03 -2.48837750405073E-09
 5.15360253906250E+03 -2.08778738975525E-01  1.46086812019348E-01
 4.55284833908081E-01  1.33514404296875E-05  0.00000000000000E+00
0
11
"""
# The example with which a receiver maker explains the format.
AGL = """01 01 2011 1800 COMMENT
1 1 1 01 01 2011 0.273825937E+05 0.000000000E+00 0.000000000E+00 0.179290771E-03
0.5286379E+00 0.9077072E-02 -0.1849365E-01 0.5264282E-03 -0.2655781E+04 -0.1586914E-02
"""
IN_2016 = gpstime.from_calendar(datetime(2016, 4, 1))


def test_yuma_and_sem_of_one_satellite_a_month_apart():
    yuma, sem = almanacs.parse(YUMA, "x", IN_2016), almanacs.parse(SEM, "x", IN_2016)
    for found, date in ((yuma, datetime(2016, 4, 2, 19, 50, 24)), (sem, datetime(2016, 3, 2, 16, 44, 48))):
        assert (found.system, found.number.tolist(), found.healthy.tolist()) == (satellites.GPS, [1], [True])
        assert gpstime.to_calendar(int(found.reference_ns[0])) == date
    apart = {name: abs(float(yuma.elements[name][0] - sem.elements[name][0])) for name in yuma.elements}
    # One orbit, in radians and in semicircles: all but the fast angles are nearly the same a month on.
    limits = {"e": 2e-4, "i0": 1e-3, "omega_dot": 1e-9, "sqrt_a": 0.1, "omega": 0.05}
    assert all(apart[name] < limit for name, limit in limits.items()), apart


@pytest.mark.parametrize(
    ("week", "near", "begin"),
    [
        (1023, datetime(1999, 8, 1), datetime(1999, 8, 15)),
        (0, datetime(1999, 8, 1), datetime(1999, 8, 22)),
        (1023, datetime(2019, 6, 1), datetime(2019, 3, 31)),
        (0, datetime(2019, 2, 1), datetime(2019, 4, 7)),
        (866, datetime(2012, 1, 1), datetime(2016, 3, 27)),
        (1890, datetime(2030, 1, 1), datetime(2016, 3, 27)),
    ],
)
def test_weeks_roll_over_where_gps_rolled_over(week, near, begin):
    """The two roll-overs there have been, of 1999-08-22 and 2019-04-07; a whole week is not touched."""
    found = almanacs.reference_ns(week, 0.0, gpstime.from_calendar(near))
    assert gpstime.to_calendar(found) == begin


def test_bulletin_of_glonass_is_in_moscow_time_and_semicircles():
    found = almanacs.parse(AGL, "x", IN_2016)
    assert (found.system, found.number.tolist(), found.healthy.tolist()) == (satellites.GLONASS, [1], [True])
    # 07:36:22.5937 in Moscow; GPS was 15 s ahead of UTC.
    assert gpstime.to_calendar(int(found.reference_ns[0])) == datetime(2011, 1, 1, 4, 36, 37, 593_700)
    assert found.elements["longitude"][0] == pytest.approx(np.deg2rad(0.5286379 * 180))
    assert found.elements["omega"][0] == pytest.approx(np.deg2rad(-0.01849365 * 180))
    assert found.elements["delta_t"][0] == -2655.781


def test_the_last_record_of_a_satellite_stands():
    later = AGL.replace("0.273825937E+05", "0.3E+05").replace("1 1 1 01", "1 1 0 01")
    found = almanacs.parse(AGL + later, "x", IN_2016)
    assert found.number.tolist() == [1]
    assert found.healthy.tolist() == [False]


@pytest.mark.parametrize(
    ("text", "old", "new", "message"),
    [
        (YUMA, "0.5221366882E-002", "0.52E", "line 4: Eccentricity is '0.52E'"),
        (YUMA, "SQRT(A)  (m 1/2)", "SQRT(B)", "line 8: SQRT(A) is missing"),
        (YUMA, "5153.602051", "inf", "line 8: SQRT(A) is 'inf'"),
        (YUMA, "week:                        866\n", "", "file ends in a satellite's record"),
        (YUMA, " 01\n", " 01.5\n", "line 2: ID is '01.5'; a whole number from 1 to 63"),
        (SEM, " 1  CURRENT", " 2  CURRENT", "line 1: number of records is 2; the file has 1"),
        (SEM, "5.10072708129883E-03", "0.5", "line 7: Eccentricity is '0.5'"),
        (SEM, "319488", "", "line 2: Time of Applicability is missing"),
        (SEM, "\n63\n", "\n63 4\n", "line 5: '4' after SVN"),
        (AGL, "1 1 1 01 01 2011", "1 1 1 31 02 2011", "line 2: day is '31'; month 2"),
        (AGL, "0.9077072E-02", "nan", "line 3: correction of the inclination is 'nan'"),
        (AGL, "-0.1586914E-02", "", "line 3: rate of the period is missing"),
        (AGL, "01 01 2011 1800", "x 01 2011 1800", "line 1: begins with 'x'; not YUMA, SEM, or AGL"),
    ],
)
def test_faults_name_line_and_field(text, old, new, message):
    assert text.count(old) == 1
    with pytest.raises(FileError, match=r"^some\.alm: ") as fault:
        almanacs.parse(text.replace(old, new), "some.alm", IN_2016)
    assert message in str(fault.value)
    assert "\n" not in str(fault.value)


@given(st.sampled_from((YUMA, SEM, AGL)), st.data())
def test_any_damage_is_read_or_refused_in_words(text, data):
    at = data.draw(st.integers(0, len(text) - 1))
    end = data.draw(st.integers(at, len(text)))
    put = data.draw(st.text(st.characters(codec="ascii"), max_size=8))
    try:
        found = almanacs.parse((text[:at] + put + text[end:]) or "\n", "x", IN_2016)
    except FileError as fault:
        assert "\n" not in str(fault)
    else:
        assert all(np.isfinite(values).all() for values in found.elements.values())


def test_of_several_records_of_a_satellite_the_nearest_in_time_stands():
    other = YUMA.replace("week:                        866", "week:                        860").replace(
        "0.5221366882E-002", "0.4E-002"
    )
    later, earlier = gpstime.from_calendar(datetime(2016, 4, 1)), gpstime.from_calendar(datetime(2016, 2, 1))
    for text in (YUMA + other, other + YUMA):
        assert almanacs.parse(text, "x", later).elements["e"].tolist() == [0.005221366882]
        assert almanacs.parse(text, "x", earlier).elements["e"].tolist() == [0.004]
    days = [
        AGL.replace("1 1 1 01 01 2011", f"1 1 {health} {day:02d} 01 2011") for day, health in ((1, 1), (9, 0))
    ]
    for text in ("".join(days), "".join(reversed(days))):
        for day, healthy in ((2, True), (8, False)):
            near_ns = gpstime.from_calendar(datetime(2011, 1, day))
            assert almanacs.parse(text, "x", near_ns).healthy.tolist() == [healthy]
