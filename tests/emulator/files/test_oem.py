"""Orbit ephemeris messages: both notations agree, faults are reported in one line."""

import re
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


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("COMMENT made by hand\n\nCCSDS_OPM_VERS = 3.0\nX = 6789.1 [km]\n", "OPM, one state"),
        (KEYWORDS.replace("OEM_VERS", "AEM_VERS"), "AEM, attitudes"),
        (XML.replace("oem>", "opm>"), "OPM, one state"),
        (XML.replace("<oem>", "<!-- by hand --><ndm:aem id='CCSDS_AEM_VERS'>"), "AEM, attitudes"),
    ],
)
def test_another_message_is_named(text, kind):
    with pytest.raises(FileError, match=f"^x: is a CCSDS {kind}; an OEM, states in time, is read$"):
        oem.parse(text, "x")


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


def segment(*states, **meta):
    """A segment of the keyword notation."""
    said = {
        "OBJECT_NAME": "CRAFT", "CENTER_NAME": "EARTH", "REF_FRAME": "EME2000", "TIME_SYSTEM": "GPS",
    } | meta  # fmt: skip
    head = "".join(f"{key} = {value}\n" for key, value in said.items())
    return f"META_START\n{head}META_STOP\n" + "".join(f"2020-01-01T{state}\n" for state in states)


ONE, TWO, THREE = "00:00:00 7000 0 0 0 7 0", "00:01:00 7000 400 0 0 7 0", "00:02:00 7000 800 0 0 7 0"
BURNT = "00:01:00 7000 400 0 0 7.5 0"


def test_segments_are_kept_apart_whatever_their_order():
    text = segment(BURNT, THREE) + segment(TWO, ONE)
    found = oem.parse(text, "x")
    assert found.begins == (0, 2)
    assert found.pos_m[:, 1].tolist() == [0, 4e5, 4e5, 8e5]
    assert found.vel_mps[:, 1].tolist() == [7000, 7000, 7500, 7000]
    start = gpstime.from_calendar(datetime(2020, 1, 1))
    assert found.useable_ns == ((start, start + 60 * 10**9), (start + 60 * 10**9, start + 120 * 10**9))
    with pytest.raises(FileError, match="x: two different states of one segment for 2020-01-01T00:01:00 GPS"):
        oem.parse(segment(ONE, TWO, BURNT), "x")
    assert len(oem.parse(segment(ONE, TWO, TWO), "x").t_ns) == 2


def test_what_is_for_use_of_a_segment_is_what_its_metadata_say():
    start = gpstime.from_calendar(datetime(2020, 1, 1))
    for said, (first_s, last_s) in (
        ({"USEABLE_START_TIME": "2020-01-01T00:00:30"}, (30, 120)),
        ({"USEABLE_STOP_TIME": "2020-01-01T00:01:30Z"}, (0, 90)),
        ({"USEABLE_STOP_TIME": "2020-01-01T01:00:00"}, (0, 120)),
        ({"USEABLE_STOP_TIME": ""}, (0, 120)),
    ):
        found = oem.parse(segment(ONE, TWO, THREE, **said), "x")
        assert found.useable_ns == ((start + first_s * 10**9, start + last_s * 10**9),)
    with pytest.raises(FileError, match="x: USEABLE_STOP_TIME: 'noon' is not an epoch"):
        oem.parse(segment(ONE, TWO, USEABLE_STOP_TIME="noon"), "x")


@pytest.mark.parametrize("centre", ["MOON", "Mars Barycenter", "EARTH BARYCENTER", "SUN", "301"])
def test_states_about_another_centre_are_refused(centre):
    with pytest.raises(FileError, match=f"x: CENTER_NAME is {centre}; states about the Earth's centre"):
        oem.parse(segment(ONE, TWO, CENTER_NAME=centre), "x")
    with pytest.raises(FileError, match=f"x: CENTER_NAME is {centre}"):
        oem.parse(segment(ONE, TWO) + segment(THREE, CENTER_NAME=centre), "x")
    xml = XML.replace("<REF_FRAME>", f"<CENTER_NAME>{centre}</CENTER_NAME><REF_FRAME>")
    with pytest.raises(FileError, match=f"x: CENTER_NAME is {centre}"):
        oem.parse(xml, "x")


def test_axes_of_a_fixed_date_are_refused():
    with pytest.raises(FileError, match="x: REF_FRAME_EPOCH is 2000-01-01T12:00:00; TEME is read as of each"):
        oem.parse(segment(ONE, TWO, REF_FRAME="TEME", REF_FRAME_EPOCH="2000-01-01T12:00:00"), "x")


def test_small_letters_and_the_earths_number_are_read():
    text = segment(ONE, TWO, CENTER_NAME="Earth", REF_FRAME="eme2000", TIME_SYSTEM="gps")
    for key in ("META_START", "META_STOP", "REF_FRAME", "TIME_SYSTEM"):
        text = text.replace(key, key.lower())
    for given in (text, segment(ONE, TWO, CENTER_NAME="399")):
        found = oem.parse(given.replace("00T", "00t"), "x")
        assert found.frame == "EME2000"
        assert found.t_ns[0] == gpstime.from_calendar(datetime(2020, 1, 1))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("<oem>", '<oem xmlns="urn:ccsds:schema:ndmxml">'),
        ("<oem>", '<oem xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:schemaLocation="a b">'),
        ("<?xml", " \n<?xml"),
        ('<?xml version="1.0"?>', '<?xml version="1.0" encoding="ISO-8859-1"?><!-- of a program -->'),
        ("<X>6789.1</X>", '<X units="KM"> 6789.1\n</X>'),
    ],
)
def test_what_plays_no_part_in_xml_changes_nothing(old, new):
    assert old in XML
    found, plain = oem.parse(XML.replace(old, new), "x"), oem.parse(XML, "x")
    assert np.array_equal(found.pos_m, plain.pos_m)
    assert np.array_equal(found.t_ns, plain.t_ns)


def test_prefixed_tags_are_read():
    text = re.sub(r"<(/?)(?=[A-Za-z])", r"<\1n:", XML).replace("<n:oem", '<n:oem xmlns:n="urn:ccsds"')
    assert np.array_equal(oem.parse(text, "x").pos_m, oem.parse(XML, "x").pos_m)


@pytest.mark.parametrize(("tag", "unit"), [("X", "m"), ("Y_DOT", "m/s"), ("Z", "ft")])
def test_units_other_than_the_standards_are_refused(tag, unit):
    with pytest.raises(FileError, match=f"x: units of {tag} are '{unit}'; allowed is km"):
        oem.parse(XML.replace(f"<{tag}>", f'<{tag} units="{unit}">'), "x")


def test_epochs_to_the_minute_and_leap_seconds():
    text = segment("00:00 7000 0 0 0 7 0", TWO).replace("2020-01-01T00:01:00", "2020-01-01T00:01:00.")
    assert np.diff(oem.parse(text, "x").t_ns).tolist() == [60 * 10**9]
    states = ("2016-12-31T23:59:59.5", "2016-12-31T23:59:60.5", "2017-01-01T00:00:00.5")
    meta = segment(TIME_SYSTEM="UTC")
    text = meta + "".join(f"{epoch} 7000 {k} 0 0 7 0\n" for k, epoch in enumerate(states))
    assert np.diff(oem.parse(text, "x").t_ns).tolist() == [10**9, 10**9]
    for odd in ("2020-000T00:00:00", "2020-367T00:00:00", "2020-01-01T00:00:61", "2020-01-01T00:00:00+03:00"):
        with pytest.raises(FileError, match="is not an epoch"):
            oem.parse(segment(ONE, TWO).replace("2020-01-01T00:00:00", odd), "x")
    with pytest.raises(FileError, match=r"x: line 7: 9020-01-01 00:00:00.* is too far from 1980"):
        oem.parse(segment(ONE, TWO).replace("2020-01-01T00:00:00", "9020-01-01T00:00:00"), "x")


def test_a_container_may_hold_other_messages():
    declaration, rest = XML.split("?>")
    other = "<opm><body><segment><metadata><OBJECT_NAME>OTHER</OBJECT_NAME></metadata></segment></body></opm>"
    found = oem.parse(f"{declaration}?><ndm>{other}{rest}</ndm>", "x")
    assert np.array_equal(found.pos_m, oem.parse(XML, "x").pos_m)


def test_comments_may_be_of_small_letters():
    whole = oem.parse(KEYWORDS, "x")
    for comment in ("comment a = b", "Comment of a program", "comment"):
        found = oem.parse(KEYWORDS.replace("META_STOP\n", f"META_STOP\n{comment}\n"), "x")
        assert found.t_ns.tolist() == whole.t_ns.tolist()
