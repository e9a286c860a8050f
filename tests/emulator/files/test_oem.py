"""Orbit ephemeris messages: both notations agree, faults are reported in one line."""

from datetime import datetime

import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.files import oem
from gnss_hil.emulator.files.text import FileError

KEYWORDS = """CCSDS_OEM_VERS = 2.0
CREATION_DATE = 2020-01-01T00:00:00
ORIGINATOR = TEST

META_START
OBJECT_NAME = CRAFT
OBJECT_ID = 2020-001A
CENTER_NAME = EARTH
REF_FRAME = EME2000
TIME_SYSTEM = UTC
START_TIME = 2020-01-01T00:00:00
STOP_TIME = 2020-01-01T00:01:00
META_STOP
COMMENT a comment
2020-01-01T00:00:00.000 6789.1 -10.5 0.25 0.1 7.5 -0.3
2020-001T00:01:00.500Z 6780.0 440.0 -17.5 -0.4 7.4 -0.2 0.001 0.002 0.003
COVARIANCE_START
EPOCH = 2020-01-01T00:00:00
3.3e-4
COVARIANCE_STOP
"""
XML = """<?xml version="1.0"?><oem><body><segment><metadata><OBJECT_NAME>CRAFT</OBJECT_NAME>
<REF_FRAME>EME2000</REF_FRAME><TIME_SYSTEM>UTC</TIME_SYSTEM></metadata><data>
<stateVector><EPOCH>2020-01-01T00:00:00</EPOCH><X>6789.1</X><Y>-10.5</Y><Z>0.25</Z>
<X_DOT>0.1</X_DOT><Y_DOT>7.5</Y_DOT><Z_DOT>-0.3</Z_DOT></stateVector>
<stateVector><EPOCH>2020-001T00:01:00.5Z</EPOCH><X>6780.0</X><Y>440.0</Y><Z>-17.5</Z>
<X_DOT>-0.4</X_DOT><Y_DOT>7.4</Y_DOT><Z_DOT>-0.2</Z_DOT></stateVector></data></segment></body></oem>
"""


@pytest.mark.parametrize("text", [KEYWORDS, XML], ids=["keywords", "xml"])
def test_both_notations(text):
    found = oem.parse(text, "x")
    assert (found.name, found.frame) == ("CRAFT", "EME2000")
    start = gpstime.from_utc(datetime(2020, 1, 1))
    assert found.t_ns.tolist() == [start, start + 60_500_000_000]
    assert np.allclose(found.pos_m, [[6789.1e3, -10.5e3, 250.0], [6.78e6, 4.4e5, -17.5e3]])
    assert np.allclose(found.vel_mps, [[100.0, 7500.0, -300.0], [-400.0, 7400.0, -200.0]])


@pytest.mark.parametrize(("system", "ahead_s"), [("GPS", 0.0), ("TAI", 19.0), ("TT", 51.184)])
def test_time_systems(system, ahead_s):
    found = oem.parse(KEYWORDS.replace("= UTC", f"= {system}"), "x")
    expected = gpstime.from_calendar(datetime(2020, 1, 1)) - round(ahead_s * 1e9)
    assert found.t_ns[0] == expected


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("6789.1", "67x9.1", r"x: line 15: X is '67x9.1', not a number"),
        ("0.1 7.5 -0.3", "0.1 7.5 nan", r"x: line 15: Z_DOT is 'nan', not finite"),
        ("0.1 7.5 -0.3", "0.1 7.5", r"x: line 15: 5 numbers behind the epoch; allowed 6 or 9"),
        ("2020-01-01T00:00:00.000", "2020-13-01T00:00:00", r"x: line 15: '2020-13-01T00:00:00' is not an ep"),
        ("TIME_SYSTEM = UTC", "TIME_SYSTEM = MET", r"x: line 15: TIME_SYSTEM is MET; allowed are UTC, GPS"),
        ("REF_FRAME = EME2000\n", "", r"x: REF_FRAME is missing in the metadata"),
        ("META_START\n", "", r"x: line 14: '2020-01-01T00:00:00.000 6789.1.*' before META_START|no segment"),
    ],
)
def test_faults_have_a_line(old, new, message):
    with pytest.raises(FileError, match=message) as caught:
        oem.parse(KEYWORDS.replace(old, new), "x")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["<oem>", "<!DOCTYPE x><oem></oem>", "<oem></oem>", "nothing here"])
def test_what_is_no_message_is_refused(text):
    with pytest.raises(FileError):
        oem.parse(text, "x")


def test_every_cut_is_read_or_refused():
    for text in (KEYWORDS, XML):
        for end in range(len(text)):
            try:
                oem.parse(text[:end], "x")
            except FileError as error:
                assert "\n" not in str(error)
