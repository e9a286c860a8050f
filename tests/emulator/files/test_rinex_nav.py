"""The RINEX reader: versions, traps of real files, and one clear line for every fault."""

from __future__ import annotations

import gzip
from datetime import datetime

import numpy as np
import pytest

from gnss_hil.emulator.files import rinex_nav
from gnss_hil.emulator.files.text import FileError

pytestmark = pytest.mark.verifies(
    "emulator/files/rinex_nav.py",
    "emulator/files/rinex_blocks.py",
    "emulator/files/rinex_layouts.py",
    "emulator/files/text.py",
    "emulator/constellation/sources.py",
    "emulator/constellation/registry.py",
    what="RINEX navigation reader",
    by=(
        "every record of five real files; of version 4 one real GPS record, GLONASS by the tables; each cut "
        "of a file is read or refused in words"
    ),
    status="validated",
)

GPS_2 = """\
     2.11           N: GPS NAV DATA                         RINEX VERSION / TYPE
                                                            END OF HEADER
 7 12 10 31  2  0  0.0 0.280183739960D-03 0.170530256582D-11 0.000000000000D+00
    0.160000000000D+02-0.343750000000D+02 0.477555606394D-08-0.712852183121D+00
   -0.175461173058d-05 0.135910103563d-02 0.710599124432E-05 0.515370994186e+04
    0.266400000000D+06 0.204890966415D-07 0.229351786584D+01 0.149011611938D-07
    0.960012929923D+00 0.242218750000D+03 0.504015801138D+00-0.808212236712D-08
   -0.432160858377D-09 0.000000000000D+00 0.171200000000D+04 0.000000000000D+00
    0.200000000000D+01 0.000000000000D+00-0.111758708954D-07 0.160000000000D+02
    0.259218000000D+06 0.400000000000D+01 0.499063314480-269 0.664593648549-315
"""
GLONASS_2 = """\
     2.01           GLONASS NAV DATA                        RINEX VERSION / TYPE
  2012    10    30    1.597218215466D-07                    CORR TO SYSTEM TIME
                                                            END OF HEADER
 3 12 10 31  0 15  0.0-1.236097887158D-04 0.000000000000D+00 1.077000000000D+04
   -2.380982128906D+04 2.289457321167D-01-3.725290298462D-09 0.000000000000D+00
   -8.908935546875D+03 2.536134719849D-01 9.313225746155D-10 2.530000000000D+02
    2.209434082031D+03 3.556049346924D+00-1.862645149231D-09 0.000000000000D+00
"""
MIXED_3 = """\
     3.05           N: GNSS NAV DATA    M: MIXED            RINEX VERSION / TYPE
GLUT -1.8626451492E-09 0.000000000E+00 432000 2190          TIME SYSTEM CORR
                                                            END OF HEADER
E01 2012 10 31 00 10 00 1.000000000000E-04 0.000000000000E+00 0.000000000000E+00
     1.000000000000E+00 1.000000000000E+00 1.000000000000E+00 1.000000000000E+00
G07 2012 10 31 02 00 00 2.801837399600E-04 1.705302565820E-12 0.000000000000E+00
     1.600000000000E+01-3.437500000000E+01 4.775556063940E-09-7.128521831210E-01
    -1.754611730580E-06 1.359101035630E-03 7.105991244320E-06 5.153709941860E+03
     2.664000000000E+05 2.048909664150E-08 2.293517865840E+00 1.490116119380E-08
     9.600129299230E-01 2.422187500000E+02 5.040158011380E-01-8.082122367120E-09
    -4.321608583770E-10 0.000000000000E+00 1.712000000000E+03 0.000000000000E+00
     2.000000000000E+00 0.000000000000E+00-1.117587089540E-08 1.600000000000E+01
     2.592180000000E+05
R03 2012 10 31 00 15 00-1.236097887158E-04 0.000000000000E+00 1.077000000000E+04
    -2.380982128906E+04 2.289457321167E-01-3.725290298462E-09 0.000000000000E+00
    -8.908935546875E+03 2.536134719849E-01 9.313225746155E-10-3.000000000000E+00
     2.209434082031E+03 3.556049346924E+00-1.862645149231E-09 0.000000000000E+00
     1.790000000000E+02 9.313225746155E-10 3.000000000000E+00 0.000000000000E+00
"""
MIXED_4 = """\
     4.01           NAVIGATION DATA     M                   RINEX VERSION / TYPE
                                                            END OF HEADER
> STO R   FDMA
    2024 02 03 00 15 00 GLUT                                  UTC(SU)
     5.184000000000e+05-8.335337042809e-08 0.000000000000e+00 0.000000000000e+00
> ION G   LNAV
    2025 06 15 00 00 00 1.862645149231E-09-1.490116119385E-08-5.960464477539E-08
     1.192092895508E-07 8.396800000000E+04-9.830400000000E+04-6.553600000000E+04
     5.242880000000E+05 0.000000000000E+00
> EPH G01 LNAV
G01 2025 06 15 02 00 00 2.915360964835E-04 1.034550223267E-11 0.000000000000E+00
     5.000000000000E+01 9.159375000000E+01 4.410898017322E-09 2.172069051852E+00
     4.749745130539E-06 5.672341212630E-04 4.006549715996E-06 5.153723411560E+03
     7.200000000000E+03-3.725290298462E-09 1.493825366040E+00 9.313225746155E-09
     9.592069088751E-01 2.984687500000E+02 2.336450295333E-01-8.210341993700E-09
     2.364384200378E-10 1.000000000000E+00 2.371000000000E+03 0.000000000000E+00
     2.000000000000E+00 0.000000000000E+00-8.847564458847E-09 3.060000000000E+02
     1.800000000000E+01 4.000000000000E+00
> EPH G01 CNAV
G01 2025 06 15 02 30 00 2.915360964835E-04 1.034550223267E-11 0.000000000000E+00
     0.000000000000E+00 9.159375000000E+01 4.410898017322E-09 2.172069051852E+00
> EPH R03 FDMA
R03 2012 10 31 00 15 00-1.236097887158E-04 0.000000000000E+00 1.077000000000E+04
    -2.380982128906E+04 2.289457321167E-01-3.725290298462E-09 0.000000000000E+00
    -8.908935546875E+03 2.536134719849E-01 9.313225746155E-10-3.000000000000E+00
     2.209434082031E+03 3.556049346924E+00-1.862645149231E-09 0.000000000000E+00
     1.790000000000E+02 9.313225746155E-10 3.000000000000E+00 0.000000000000E+00

"""
GPS_EXPECTED = {"af0": 0.280183739960e-3, "cuc": -0.175461173058e-5, "sqrt_a": 5153.70994186, "toe": 266400.0}


def value(records, name):
    return records.fields[name][0]


def test_version_2_gps():
    """Exponent letters D, d, E, e; an exponent without a letter, as brdc3050.12n has them."""
    gps = rinex_nav.parse(GPS_2, "x").records["G"]
    assert gps.number.tolist() == [7]
    assert gps.epoch == (datetime(2012, 10, 31, 2),)
    for name, expected in GPS_EXPECTED.items():
        assert value(gps, name) == expected
    assert value(gps, "fit_h") == 4


def test_an_exponent_that_lost_its_letter():
    text = GPS_2.replace("-0.808212236712D-08", "-0.808212236712-008")
    assert value(rinex_nav.parse(text, "x").records["G"], "omega_dot") == -0.808212236712e-8


def test_version_2_glonass():
    """Units as written; a frequency number written as an unsigned byte, as brdc0910.09g has it."""
    file = rinex_nav.parse(GLONASS_2, "x")
    slot = file.records["R"]
    assert file.glonass_to_utc_s == 1.597218215466e-07
    assert slot.number.tolist() == [3]
    assert slot.epoch == (datetime(2012, 10, 31, 0, 15),)
    assert (value(slot, "minus_tau"), value(slot, "x_km")) == (-1.236097887158e-04, -2.380982128906e04)
    assert value(slot, "vz_kmps") == 3.556049346924
    assert value(slot, "frequency") == -3


def test_version_3_mixed_with_five_line_glonass_and_other_systems():
    """The same ephemerides as in version 2; a blank fit interval is 0; Galileo is passed over."""
    file = rinex_nav.parse(MIXED_3, "x")
    assert sorted(file.records) == ["G", "R"]
    assert file.glonass_to_utc_s == -1.8626451492e-09
    for letter, old in (("G", GPS_2), ("R", GLONASS_2)):
        new, before = file.records[letter], rinex_nav.parse(old, "y").records[letter]
        assert new.number.tolist() == before.number.tolist()
        assert new.epoch == before.epoch
        same = set(new.fields) - {"fit_h", "status", "delta_tau", "urai"}
        assert {n: value(new, n) for n in same} == {n: value(before, n) for n in same}
    assert value(file.records["G"], "fit_h") == 0


def test_the_fifth_line_of_glonass_has_the_delay_of_l2():
    """RINEX 3.05, table A10: status, Delta tau, accuracy, health; blank or .999999999999E+09: not known."""
    slot = rinex_nav.parse(MIXED_3, "x").records["R"]
    assert (value(slot, "status"), value(slot, "delta_tau"), value(slot, "urai")) == (
        179,
        9.313225746155e-10,
        3,
    )
    for text in (" .999999999999E+09", " " * 18):
        unknown = MIXED_3.replace(" 9.313225746155E-10 3.000000000000E+00", f"{text:>19} 3.000000000000E+00")
        assert value(rinex_nav.parse(unknown, "x").records["R"], "delta_tau") == 0
    four = "\n".join(MIXED_3.splitlines()[:-1]).replace("3.05", "3.04")
    assert value(rinex_nav.parse(four, "x").records["R"], "delta_tau") == 0
    strange = MIXED_3.replace("9.313225746155E-10 3.0000", "9.313225746155E-03 3.0000")
    with pytest.raises(FileError, match=r"line 18: delta_tau is 0\.00931323; allowed is -1e-06 to 1e-06"):
        rinex_nav.parse(strange, "x")


def test_version_4():
    """G01 as ESA's receivers heard it on 2025-06-15, an offset as RINEX 4.02 shows one; other messages of
    the same satellites, which number their fields otherwise, are passed over."""
    file = rinex_nav.parse(MIXED_4, "x")
    gps, glonass = file.records["G"], file.records["R"]
    assert sorted(file.records) == ["G", "R"]
    assert (len(gps), len(glonass)) == (1, 1)
    assert gps.epoch == (datetime(2025, 6, 15, 2),)
    expected = {
        "af0": 2.915360964835e-4,
        "sqrt_a": 5153.72341156,
        "toe": 7200,
        "week": 2371,
        "iodc": 306,
        "fit_h": 4,
    }
    assert {name: value(gps, name) for name in expected} == expected
    before = rinex_nav.parse(MIXED_3, "y").records["R"]
    assert {n: value(glonass, n) for n in glonass.fields} == {n: value(before, n) for n in before.fields}
    assert file.glonass_to_utc_s == -8.335337042809e-08


def test_four_line_glonass_of_version_3_04():
    text = "\n".join(MIXED_3.splitlines()[:-1]).replace("3.05", "3.04")
    assert value(rinex_nav.parse(text, "x").records["R"], "frequency") == -3


@pytest.mark.parametrize(("year", "full"), [("80", 1980), ("99", 1999), ("00", 2000), ("79", 2079)])
def test_years_of_two_digits(year, full):
    text = GPS_2.replace(" 7 12 10 31", f" 7 {year} 10 31")
    assert rinex_nav.parse(text, "x").records["G"].epoch[0].year == full


def test_windows_line_ends_and_trailing_blank_lines():
    text = GPS_2.replace("\n", "\r\n") + "\r\n   \r\n"
    assert value(rinex_nav.parse(text, "x").records["G"], "fit_h") == 4


def test_gzip_is_known_by_content(tmp_path):
    path = tmp_path / "nav.12n"
    path.write_bytes(gzip.compress(GPS_2.encode()))
    assert len(rinex_nav.read(path).records["G"]) == 1


def cut(text, lines):
    return "\n".join(text.splitlines()[:lines]) + "\n"


FAULTS = [
    ("first line", "hello\n", "", "", "line 1: not a RINEX file"),
    ("version 5", MIXED_3, "3.05", "5.00", "line 1: RINEX version is 5.00; 2, 3 and 4 are read"),
    ("no announcement", MIXED_3, "3.05", "4.00", "line 4: expected '>' and the kind of a record"),
    ("kind", MIXED_4, "> ION G  ", "> IOM G  ", "line 6: record is '> IOM G   LNAV'; allowed is such as"),
    ("no message", MIXED_4, "> EPH G01 LNAV", "> EPH G01", "line 10: record is '> EPH G01'; allowed is"),
    (
        "nothing",
        MIXED_4,
        "> ION G   LNAV",
        "> ION G   LNAV\n> ION G   LNAV",
        "line 6: the ION record from line 6",
    ),
    ("4: record cut", cut(MIXED_4, 15), "", "", "line 15: GPS record from line 11 has 5 lines; it needs 8"),
    (
        "4: field",
        MIXED_4,
        "5.153723411560E+03",
        "5.15372341x560E+03",
        "line 13: sqrt_a is '5.15372341x560E+03'",
    ),
    (
        "4: tau_c",
        MIXED_4,
        "-8.335337042809e-08",
        "-8.33533704x809e-08",
        "line 5: GLUT is '-8.33533704x809e-08'",
    ),
    ("version word", MIXED_3, "3.05", "x.05", "line 1: RINEX version is 'x.05', not a number"),
    ("observations", GPS_2, "N: GPS", "O: OBS", "file type is 'O: OBS NAV DATA'; navigation data is N or G"),
    ("header cut", cut(GPS_2, 1), "", "", "line 1: file ends inside the header"),
    ("record cut", cut(GPS_2, 7), "", "", "line 7: GPS record from line 3 has 5 lines; it needs 8"),
    (
        "glonass cut",
        cut(GLONASS_2, 6),
        "",
        "",
        "line 6: GLONASS record from line 4 has 3 lines; it needs 4 or 5",
    ),
    ("field", GPS_2, "0.515370994186e+04", "0.5153x0994186e+04", "line 5: sqrt_a is '0.5153x0994186e+04'"),
    ("cut field", GPS_2, "0.515370994186e+04", "", "line 5: sqrt_a is '', not a number"),
    (
        "digits grouped",
        GPS_2,
        "0.515370994186e+04",
        "0.5153_0994186e+04",
        "line 5: sqrt_a is '0.5153_0994186e+04'",
    ),
    ("not finite", GPS_2, "0.710599124432E-05", "               nan", "line 5: cus is 'nan', not a number"),
    ("infinite", GPS_2, "-0.712852183121D+00", "-0.71285218312D+999", "line 4: m0 is '-0.71285218312D+999'"),
    ("no orbit", GPS_2, "0.515370994186e+04", "0.000000000000e+00", "line 5: sqrt_a is 0; allowed is 2600"),
    (
        "clock",
        GPS_2,
        "0.280183739960D-03",
        "0.280183739960D+93",
        "line 3: af0 is 2.80184e+92; allowed is -0.1",
    ),
    ("angle", GPS_2, "0.960012929923D+00", "0.960012929923D+51", "line 7: i0 is 9.60013e+50; allowed is -10"),
    (
        "time",
        GPS_2,
        "0.266400000000D+06",
        "0.266400000000D+07",
        "line 6: toe is 2.664e+06; allowed is 0 to 604800",
    ),
    (
        "place",
        GLONASS_2,
        "-2.380982128906D+04",
        "-2.380982128906D+06",
        "line 5: x_km is -2.38098e+06; allowed",
    ),
    ("frequency", GLONASS_2, "2.530000000000D+02", "1.400000000000D+01", "line 6: frequency is 14; allowed"),
    ("epoch", GPS_2, " 7 12 10 31", " 7 12 13 31", "line 3: '7 12 13 31  2  0  0.0' is not a satellite"),
    ("satellite", GPS_2, " 7 12 10", " 0 12 10", "line 3: satellite number is 0; allowed is 1 to 63"),
    ("stray line", MIXED_3, "E01 2012", "    2012", "line 4: expected the first line of a record"),
    ("tau_c", GLONASS_2, "1.597218215466D-07", "1.5972182x5466D-07", "line 2: CORR TO SYSTEM TIME is"),
]


@pytest.mark.parametrize(
    ("text", "old", "new", "expected"), [f[1:] for f in FAULTS], ids=[f[0] for f in FAULTS]
)
def test_a_fault_is_one_line_with_file_and_place(text, old, new, expected):
    assert old in text
    with pytest.raises(FileError) as caught:
        rinex_nav.parse(text.replace(old, new), "some.nav")
    message = str(caught.value)
    assert message.startswith("some.nav: ")
    assert expected in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (None, "No such file or directory"),
        (b"", "file is empty"),
        (b"  \n", "file is empty"),
        (gzip.compress(GPS_2.encode())[:-20], "gzip data is cut off or damaged"),
        (b"\x1f\x8b\x08\x00rubbish that is no gzip", "gzip data is cut off or damaged"),
        (b"     2.11\n\x02\xfe", "line 2: byte 0x02 is not text"),
        (b"     2.11\n\n\x00", "line 3: byte 0x00 is not text"),
    ],
    ids=["missing", "empty", "blank", "cut gzip", "bad gzip", "binary", "nul"],
)
def test_files_that_cannot_be_read(tmp_path, content, expected):
    path = tmp_path / "nav"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(FileError) as caught:
        rinex_nav.read(path)
    assert str(caught.value) == f"{path}: {expected}"


def test_a_folder_is_no_file(tmp_path):
    with pytest.raises(FileError, match="Is a directory"):
        rinex_nav.read(tmp_path)


def test_every_cut_of_a_file_is_read_or_refused_in_words():
    """Truncation anywhere never escapes as another exception."""
    refused = 0
    for text in (GPS_2, GLONASS_2, MIXED_3, MIXED_4):
        for end in range(1, len(text), 7):
            try:
                rinex_nav.parse(text[:end], "x")
            except FileError as error:
                refused += 1
                assert str(error).startswith("x: line ")
    assert refused > 300


@pytest.mark.parametrize("unknown", ["0.999900000000D+09", ".999999999999E+09", ""])
def test_fields_that_are_unknown_are_none(unknown):
    """RINEX 2.11, table A4; 3.05, tables A6 and A10: .9999E9 where the time of transmission is not known."""
    text = GPS_2.replace("0.259218000000D+06 0.400000000000D+01", f"{unknown:>18} {unknown:>18}")
    found = rinex_nav.parse(text, "x").records["G"].fields
    assert np.isnan(found["transmission"][0])
    assert found["fit_h"].tolist() == [0.0]
    text = GLONASS_2.replace("1.077000000000D+04", f"{unknown:>18}")
    assert np.isnan(rinex_nav.parse(text, "x").records["R"].fields["message_time"][0])


def test_a_record_without_a_place_is_none():
    zero = " 0.000000000000D+00"
    whole = rinex_nav.parse(GLONASS_2, "x").records["R"]
    text = GLONASS_2
    for axis in ("-2.380982128906D+04", "-8.908935546875D+03", " 2.209434082031D+03"):
        assert axis in text
        text = text.replace(axis, zero)
    assert "R" not in rinex_nav.parse(text, "x").records
    both = rinex_nav.parse(text + GLONASS_2[GLONASS_2.index(" 3 12 10") :], "x").records["R"]
    assert len(both) == len(whole) == 1


def test_types_in_small_letters_are_read():
    assert len(rinex_nav.parse(GPS_2.replace("N: GPS NAV", "n: GPS NAV"), "x").records["G"]) == 1


def test_blank_lines_between_records_are_no_part_of_them():
    head, record = GPS_2.split("END OF HEADER\n")
    text = f"{head}END OF HEADER\n{record}\n   \n{record}\n"
    assert len(rinex_nav.parse(text, "x").records["G"]) == 2


def record_of(text, *changes):
    """The record of a file of one, changed."""
    head, record = text.split("END OF HEADER\n")
    for old, new in changes:
        assert old in record
        record = record.replace(old, new)
    return f"{head}END OF HEADER\n", record


@pytest.mark.parametrize(
    "changes",
    [
        [
            ("0.515370994186e+04", "0.000000000000D+00"),
            ("0.135910103563d-02", "0.000000000000D+00"),
            ("-0.712852183121D+00", " 0.000000000000D+00"),
            ("0.960012929923D+00", "0.000000000000D+00"),
        ],
        [("0.280183739960D-03", "0.999999999999D+09")],
        [("0.515370994186e+04", "0.999900000000D+09")],
        [("-0.111758708954D-07", " 0.999999999999D+09")],
    ],
    ids=["all zero", "clock unknown", "orbit unknown", "delay unknown"],
)
def test_a_record_of_zeros_or_of_what_is_unknown_is_left_out_and_counted(changes):
    head, bad = record_of(GPS_2, *changes)
    _, good = record_of(GPS_2)
    found = rinex_nav.parse(head + bad + good, "x")
    assert len(found.records["G"]) == 1
    assert found.placeless == {"G": 1}
    assert not rinex_nav.parse(head + good, "x").placeless


def test_letters_of_either_size_are_labels_systems_and_kinds():
    for text in (GPS_2, GLONASS_2, MIXED_3, MIXED_4):
        small = "\n".join(line[:60] + line[60:].lower() for line in text.splitlines())
        small = (
            small.replace("G0", "g0").replace("R0", "r0").replace("> EPH", "> eph").replace("LNAV", "lnav")
        )
        found, whole = rinex_nav.parse(small, "x"), rinex_nav.parse(text, "x")
        assert found.records.keys() == whole.records.keys()
        assert found.glonass_to_utc_s == whole.glonass_to_utc_s


def test_records_of_one_time_that_contradict_each_other_are_known():
    head, record = record_of(GPS_2)
    other = record_of(GPS_2, ("0.229351786584D+01", "0.229351786585D+01"))[1]
    elsewhere = record_of(GPS_2, ("0.229351786584D+01", "0.239351786584D+01"))[1]
    later = record_of(GPS_2, ("0.259218000000D+06", "0.259248000000D+06"), ("0.22935", "0.23935"))[1]
    for text, rivals in ((record, []), (other, []), (later, []), (elsewhere, [7])):
        found = rinex_nav.parse(head + record + text, "x").records["G"]
        assert rinex_nav.rivals(found) == rivals
    glonass = "".join(record_of(GLONASS_2, *c)[1] for c in ((), (("2.209434", "2.309434"),)))
    assert rinex_nav.rivals(rinex_nav.parse(record_of(GLONASS_2)[0] + glonass, "x").records["R"]) == [3]
