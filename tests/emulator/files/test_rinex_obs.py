"""The observation reader: versions, traps of real files, and one clear line for every fault."""

from __future__ import annotations

from datetime import datetime

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.emulator.files import rinex_obs
from gnss_hil.emulator.files.text import FileError, decoded
from tests.support.rinex_observations import GPS_2, MIXED_3, header_line, version_3_tags_in

NAN = np.nan


def names(found):
    return [satellites.name(index) for index in found.sat]


def tags(found):
    return [gpstime.to_calendar(t) for t in found.t_ns.tolist()]


def test_version_2():
    """Blank letter and fields, short lines; a tag to 0.1 us; a power failure (flag 1) is an epoch too."""
    found = rinex_obs.parse(GPS_2, "x")
    assert found.t_ns.tolist() == [
        gpstime.from_calendar(datetime(2010, 7, 27)),
        gpstime.from_calendar(datetime(2010, 7, 27, 0, 0, 10)) + 100,
    ]
    assert found.clock_s == pytest.approx((123e-9, NAN), nan_ok=True)
    assert found.epoch.tolist() == [0, 0, 1]
    assert names(found) == ["G09", "G11", "G11"]
    expected = {
        "L1": (107576007.037, -112972191.775, 107765767.230),
        "L2": (83825474.871, NAN, NAN),
        "C1": (20471032.921, 21497892.818, NAN),
        "P1": (NAN, 21497893.313, NAN),
        "P2": (20471037.276, 21497897.589, NAN),
        "LA": (107576003.542, 112972189.284, NAN),
        "SA": (669.0, NAN, NAN),
        "S1": (NAN, NAN, NAN),
        "S2": (320.0, NAN, NAN),
    }
    assert list(found.obs) == list(expected)
    for code, values in expected.items():
        assert np.array_equal(found.obs[code], values, equal_nan=True), code
    assert found.lli["L1"].tolist() == [4, 4, 1]
    assert found.lli["LA"].tolist() == [5, 4, 0]
    header = found.header
    assert (header.marker, header.receiver, header.antenna) == ("GRACE B", "BLACKJACK", "CHOKE RING")
    assert header.position_ecef_m.tolist() == [4000000.1, -500000.2, 4900000.3]
    assert header.delta_hen_m.tolist() == [0.1, 0.2, 0.3]
    assert (header.interval_s, header.scale, header.clock_applied) == (10, "GPS", False)
    assert (header.wave_factors, header.wave_factors_of) == ((1, 1), {satellites.parse("G07"): (1, 2)})


def test_version_3():
    """Codes by system, scale factors, frequency numbers; a satellite of an unknown system is passed over
    and counted."""
    found = rinex_obs.parse(MIXED_3, "x")
    assert names(found) == ["G07", "R21", "E11", "G07"]
    assert found.epoch.tolist() == [0, 0, 0, 1]
    assert list(found.obs) == ["C1C", "L1C", "D1C", "S1C", "C2W", "C1X"]
    expected = {
        "C1C": (23456789.012, 19456789.012, NAN, 23456790.012),
        "L1C": (123266789.123, 103999.0, NAN, NAN),
        "D1C": (-1234.567, NAN, NAN, NAN),
        "S1C": (45.25, NAN, NAN, NAN),
        "C2W": (NAN, NAN, NAN, 23456791.5),
        "C1X": (NAN, NAN, 25456789.012, NAN),
    }
    for code, values in expected.items():
        assert np.array_equal(found.obs[code], values, equal_nan=True), code
    assert found.lli["L1C"].tolist() == [2, 1, 0, 0]
    assert {letter: rows.tolist() for letter, rows in found.passed.items()} == {"L": [0]}
    assert found.header.codes["R"] == ("C1C", "L1C")
    assert found.header.frequencies == {3: 5, 21: -4}
    assert found.header.clock_applied
    assert np.isnan(found.header.position_ecef_m).all()
    assert found.clock_s == pytest.approx((1.234e-9, NAN), nan_ok=True)


@pytest.mark.parametrize(
    ("scale", "ahead_s"), [("GPS", 0), ("GAL", 0), ("QZS", 0), ("IRN", 0), ("GLO", 16), ("BDT", 14)]
)
def test_time_scales(scale, ahead_s):
    """GPS - UTC was 16 s on that day (IERS Bulletin C 43), GPS - BDT is 14 s (BeiDou ICD 3.3)."""
    found = rinex_obs.parse(version_3_tags_in(scale), "x")
    start_ns = gpstime.from_calendar(datetime(2012, 10, 31, 0, 15))
    assert found.t_ns[0] - start_ns == ahead_s * gpstime.NS_PER_S


def test_a_pure_glonass_file_counts_utc_if_it_does_not_say():
    text = (
        GPS_2.replace("G (GPS)", "R (GLO)")
        .replace("GPS         TIME", "            TIME")
        .replace("G11", "R11")
    )
    found = rinex_obs.parse(text, "x")
    assert found.header.scale == "GLO"
    assert names(found) == ["R09", "R11", "R11"]
    assert found.t_ns[0] == gpstime.from_utc(datetime(2010, 7, 27))


def with_event(flag, *lines):
    """GPS_2 with an event between its epochs."""
    head, tail = GPS_2.split(" 10  7 27  0  0 10.0")
    return f"{head}{'':28}{flag}{len(lines):3d}\n{''.join(lines)} 10  7 27  0  0 10.0{tail}"


def test_events_are_passed_over():
    """New site, header lines in between, an external event; cycle slips look like observations."""
    plain = rinex_obs.parse(GPS_2, "x")
    slips = " 10  7 27  0  0  5.0000000  6  1G11\n" + " " * 80 + "\n\n"
    before, after = GPS_2.split(" 10  7 27  0  0 10.0")
    for text in (
        with_event(3, header_line("ELSEWHERE", "MARKER NAME"), header_line("moved", "COMMENT")),
        with_event(
            4, header_line("", "COMMENT"), next(x for x in GPS_2.splitlines(True) if "# / TYPES" in x)
        ),
        with_event(5),
        f"{before}{slips} 10  7 27  0  0 10.0{after}",
    ):
        found = rinex_obs.parse(text, "x")
        assert found.t_ns.tolist() == plain.t_ns.tolist()
        for code in plain.obs:
            assert np.array_equal(found.obs[code], plain.obs[code], equal_nan=True)


def test_more_satellites_than_a_line_holds_and_more_codes_than_a_header_line():
    """Fourteen satellites, eleven codes: lines go on."""
    codes = ("L1", "L2", "C1", "P1", "P2", "D1", "D2", "S1", "S2", "T1", "T2")
    listed = "".join(f"    {code}" for code in codes)
    text = (
        header_line("     2.11           OBSERVATION DATA    M (MIXED)", "RINEX VERSION / TYPE")
        + header_line(f"    11{listed[:54]}", "# / TYPES OF OBSERV")
        + header_line(f"      {listed[54:]}", "# / TYPES OF OBSERV")
        + header_line("  2010     7    27     0     0    0.0000000     GPS", "TIME OF FIRST OBS")
        + header_line("", "END OF HEADER")
    )
    stars = [f"G{n:02d}" for n in range(1, 9)] + [f"R{n:02d}" for n in range(1, 7)]
    text += (
        " 10  7 27  0  0  0.0000000  0 14"
        + "".join(stars[:12])
        + "\n"
        + " " * 32
        + "".join(stars[12:])
        + "\n"
    )
    for n in range(14):
        values = [f"{100 * n + k + 1:14.3f}  " for k in range(11)]
        text += "\n".join("".join(values[c : c + 5]) for c in (0, 5, 10)) + "\n"
    found = rinex_obs.parse(text, "x")
    assert names(found) == stars
    for k, code in enumerate(codes):
        assert found.obs[code].tolist() == [100 * n + k + 1 for n in range(14)]


def test_windows_line_ends():
    found, plain = rinex_obs.parse(GPS_2.replace("\n", "\r\n"), "x"), rinex_obs.parse(GPS_2, "x")
    for code in plain.obs:
        assert np.array_equal(found.obs[code], plain.obs[code], equal_nan=True)


FAULTS = [
    ("no rinex", "hello\n", "", "", "line 1: not a RINEX file"),
    ("version", GPS_2, "     2.20", "     5.20", "line 1: RINEX version is 5.20; 2, 3 and 4 are read"),
    (
        "type",
        GPS_2,
        "OBSERVATION DATA",
        "NAVIGATION DATA ",
        "line 1: file type is 'NAVIGATION DATA'; observation",
    ),
    ("header cut", "\n".join(GPS_2.splitlines()[:5]), "", "", "line 5: file ends inside the header"),
    (
        "position",
        GPS_2,
        "4000000.1000",
        "40000x0.1000",
        "line 3: APPROX POSITION XYZ is '40000x0.1000'; allowed is",
    ),
    (
        "wave factor",
        GPS_2,
        "     1     1  ",
        "     1     7  ",
        "line 7: WAVELENGTH FACT L1/2 is '7'; allowed is",
    ),
    ("wave factor's satellite", GPS_2, "   G07", "   G7x", "line 8: WAVELENGTH FACT L1/2: 'G7x' is not a"),
    ("codes", GPS_2, "     9    L1", "    10    L1", "line 12: 9 observation codes were read; 10 were"),
    ("code twice", GPS_2, "    P1    P2", "    P1    P1", "line 9: observation codes are 'L1 L2 C1 P1 P1"),
    (
        "no codes",
        GPS_2,
        "# / TYPES OF OBSERV",
        "COMMENT            ",
        "line 12: observation codes are missing",
    ),
    (
        "codes of version 3",
        MIXED_3,
        "     3.05",
        "     2.11",
        "line 11: observation codes are missing; version 2.11",
    ),
    ("codes cut", MIXED_3, "G    5 C1C", "G   14 C1C", "line 3: observation codes are 'C1C"),
    (
        "interval",
        GPS_2,
        "    10.000 ",
        "   x10.000 ",
        "line 10: INTERVAL is 'x10.000'; allowed is a number from",
    ),
    ("time system", GPS_2, "     GPS ", "     ABC ", "line 11: time system is 'ABC'; allowed is GPS, GLO"),
    ("scale factor", MIXED_3, "R  100", "R  1x0", "line 6: SYS / SCALE FACTOR is '1x0'; allowed is"),
    ("slot", MIXED_3, "R03  5", "R99  5", "line 7: GLONASS SLOT is '99'; allowed is"),
    ("frequency", MIXED_3, "R03  5", "R03 98", "line 7: GLONASS FRQ # is '98'; allowed is"),
    (
        "epoch",
        GPS_2,
        " 10  7 27  0  0  0.0",
        " 10 13 27  0  0  0.0",
        "line 13: epoch is '10 13 27  0  0  0.0",
    ),
    ("epoch word", MIXED_3, "> 2012 10", "> 2012 xx", "line 12: epoch is '2012 xx 31 00 15"),
    (
        "epoch again",
        GPS_2,
        "  0 10.0000001",
        "  0  0.0000000",
        "line 18: epoch is '10  7 27  0  0  0.0000000'; it does",
    ),
    ("flag", GPS_2, "0.0000000  0  2", "0.0000000  8  2", "line 13: epoch flag is '8'; allowed is 0 to 6"),
    (
        "count",
        GPS_2,
        "0.0000000  0  2",
        "0.0000000  0 xx",
        "line 13: number of satellites is ' xx'; allowed is 0",
    ),
    ("clock", GPS_2, "  .000000123", "  .0000x0123", "line 13: receiver clock offset is '.0000x0123'"),
    (
        "infinite",
        GPS_2,
        "  .000000123",
        "         inf",
        "line 13: receiver clock offset is 'inf'; not a number",
    ),
    ("satellite", GPS_2, "  2  9G11", "  2  9Gx1", "line 13: 'Gx1' is not a satellite name"),
    ("satellite zero", GPS_2, "  2  9G11", "  2  0G11", "line 13: 'G00' is not a satellite name"),
    ("satellite twice", GPS_2, "  2  9G11", "  2 11G11", "line 16: the epoch has this satellite already"),
    (
        "too few lines",
        GPS_2,
        "  2  9G11",
        "  4  9G11G12G13",
        "line 20: file ends inside the epoch from line 13",
    ),
    (
        "value",
        GPS_2,
        "107576007.037",
        "107576x07.037",
        "line 14: L1 is ' 107576x07.037'; allowed is F14.3 or blank",
    ),
    ("point", GPS_2, "107576007.037", "1075760070.37", "line 14: L1 is ' 1075760070.37'; allowed is F14.3"),
    (
        "two numbers",
        GPS_2,
        " 20471032.921",
        " 204710 2.921",
        "line 14: C1 is '  204710 2.921'; allowed is F14.3",
    ),
    (
        "lock",
        GPS_2,
        "107576007.03748",
        "107576007.037x8",
        "line 14: loss of lock of L1 is 'x'; allowed is a digit",
    ),
    ("no epoch", GPS_2[: GPS_2.index(" 10  7 27")], "", "", "line 12: no observation follows the header"),
    ("stray line", MIXED_3, "> 2012 10 31 00 15  1.0", "  2012 10 31 00 15  1.0", "line 17: '  2012 10 31"),
    (
        "codes change",
        with_event(4, header_line("     1    L1", "# / TYPES OF OBSERV")),
        "",
        "",
        "line 19: # / TYPES OF OBSERV changes here",
    ),
    ("event cut", GPS_2, "  1  1G11", "  4 99G11", "line 20: file ends inside the event record from line 18"),
]


@pytest.mark.parametrize(
    ("text", "old", "new", "expected"), [f[1:] for f in FAULTS], ids=[f[0] for f in FAULTS]
)
def test_a_fault_is_one_line_with_file_and_place(text, old, new, expected):
    assert old in text
    with pytest.raises(FileError) as caught:
        rinex_obs.parse(text.replace(old, new, 1) if old else text, "some.10o")
    message = str(caught.value)
    assert message.startswith("some.10o: line ")
    assert expected in message
    assert "\n" not in message


def tried(text):
    """What a text says, or None where its one line is in order."""
    try:
        return rinex_obs.parse(text, "x")
    except FileError as error:
        assert str(error).startswith("x: line ")
        assert "\n" not in str(error)
        return None


def test_every_cut_of_a_file_is_read_or_refused_in_words():
    """And no number that was cut is taken for a shorter one."""
    refused = 0
    for text in (GPS_2, MIXED_3):
        whole = rinex_obs.parse(text, "x")
        for end in range(1, len(text)):
            found = tried(text[:end])
            refused += found is None
            for code in found.obs if found else ():
                present = np.isfinite(found.obs[code])
                assert np.array_equal(found.obs[code][present], whole.obs[code][: len(present)][present])
    assert refused > 2000


@given(st.sampled_from((GPS_2, MIXED_3)), st.integers(0, 3000), st.characters(max_codepoint=126))
def test_any_character_anywhere_is_read_or_refused_in_words(text, place, character):
    place %= len(text)
    tried(text[:place] + character + text[place + 1 :])


@pytest.mark.parametrize(
    "zero",
    [
        "         0.000", "          .000", "        -0.000", " " * 14, "9999999999.999", "     99999.999",
        "  99999999.000", " -99999999.990", "   9999999.900",
    ],
)  # fmt: skip
def test_zero_stands_for_none_whatever_is_observed(zero):
    """RINEX 2.11, table A2; 3.05, table A3: missing observations are written as 0.0 or blanks."""
    for value, code in (("23456789.012", "C1C"), ("-1234.567", "D1C"), ("45.250", "S1C")):
        assert np.isfinite(rinex_obs.parse(MIXED_3, "x").obs[code][0])
        absent = rinex_obs.parse(MIXED_3.replace(f"{value:>14}", zero), "x")
        assert np.isnan(absent.obs[code][0])
    for near in ("     99999.998", "      9999.999", "  99999999.001"):
        read = rinex_obs.parse(MIXED_3.replace(f"{'-1234.567':>14}", near), "x")
        assert read.obs["D1C"][0] == float(near)


def test_definitions_that_an_event_repeats_in_other_words_are_read():
    """The blanks of the header's lines, and how many codes it has on each, say nothing."""
    again = (
        header_line("G    5 C1C  L1C D1C S1C C2W ", "SYS / # / OBS TYPES")
        + header_line("R    2  C1C L1C", "SYS / # / OBS TYPES ")
        + header_line("E    1 C1X", "SYS / # / OBS TYPES")
        + header_line("R 100   1  L1C", "SYS / SCALE FACTOR")
        + header_line("ANOTHER", "MARKER NAME")
    )
    place = MIXED_3.index("> 2012 10 31 00 15  1.0")
    event = MIXED_3[:place] + ">" + " " * 30 + "4  5\n" + again + MIXED_3[place:]
    whole, found = rinex_obs.parse(MIXED_3, "x"), rinex_obs.parse(event, "x")
    assert len(found.t_ns) == len(whole.t_ns) == 2
    for old, new, label in (
        ("G    5 C1C  L1C", "G    5 L1C  C1C", "SYS / # / OBS TYPES"),
        ("R 100   1  L1C", "R 100   1  C1C", "SYS / # / OBS TYPES"),
    ):
        with pytest.raises(FileError, match=f"{label} changes here; files are read in which it stays"):
            rinex_obs.parse(event.replace(old, new), "x")


def test_a_blank_flag_is_zero_and_small_letters_are_satellites():
    for old, new in (
        ("0.0000000  0  2", "0.0000000     2"),
        ("  2  9G11", "  2  9g11"),
        ("OBSERVATION DATA    G", "observation data    g"),
    ):
        assert old in GPS_2
        assert len(rinex_obs.parse(GPS_2.replace(old, new), "x").sat) == 3


def test_the_unit_of_strengths_is_the_headers():
    with_unit = MIXED_3.replace(
        header_line("TEST", "MARKER NAME"), header_line("dBHz", "SIGNAL STRENGTH UNIT")
    )
    assert rinex_obs.parse(with_unit, "x").header.strength_unit == "DBHZ"
    assert not rinex_obs.parse(MIXED_3, "x").header.strength_unit


def test_letters_of_names_shift_no_column():
    for encoded in ("Übung à la".encode(), "Übung à la".encode("latin-1")):
        raw = MIXED_3.encode().replace(b"TEST      ", encoded.ljust(10))
        found = rinex_obs.parse(decoded(raw, "x"), "x")
        assert found.header.marker.startswith("Übung à la")
        assert np.array_equal(found.obs["C1C"], rinex_obs.parse(MIXED_3, "x").obs["C1C"], equal_nan=True)


@pytest.mark.parametrize("none", ["     -9999.000", "      9999.000", "         1.000", "  20000000.000"])
def test_what_satellites_of_an_epoch_share_is_none_and_counted(none):
    """Ranges, phases and Dopplers; strengths are whole numbers, and often the same."""
    epoch = "> 2012 10 31 00 15  1.0000000  0  4\n"
    strong = f"{45.0:14.3f}  "
    cells = {"G07": none, "G08": none, "G09": f"{1234.567:14.3f}", "G10": none}
    rows = "".join(f"{sat}{cell}  {cell}  {cell}  {strong}\n" for sat, cell in cells.items())
    head = (
        header_line("     3.04           OBSERVATION DATA    G", "RINEX VERSION / TYPE")
        + header_line("G    4 C1C L1C D1C S1C", "SYS / # / OBS TYPES")
        + header_line("", "END OF HEADER")
    )
    found = rinex_obs.parse(head + epoch + rows, "x")
    for code in ("C1C", "L1C", "D1C"):
        assert np.isfinite(found.obs[code]).tolist() == [False, False, True, False]
    assert found.obs["S1C"].tolist() == [45.0] * 4
    assert found.repeated == {"C1C": 3, "L1C": 3, "D1C": 3}
    two = rinex_obs.parse(head + epoch + rows.replace(none, f"{7654.321:14.3f}", 3), "x")
    assert np.isfinite(two.obs["C1C"]).all()
    assert not two.repeated
    later = epoch.replace(" 1.0000000  0  4", " 2.0000000  0  2") + "".join(rows.splitlines(True)[:2])
    assert rinex_obs.parse(head + later, "x").repeated == {}


def test_letters_of_either_size_are_labels_and_codes():
    small = "\n".join(line.lower() if line[60:].strip() else line for line in MIXED_3.splitlines()) + "\n"
    found, whole = rinex_obs.parse(small, "x"), rinex_obs.parse(MIXED_3, "x")
    assert found.header.codes == whole.header.codes
    assert found.header.scale_factors == whole.header.scale_factors
    assert found.obs["C1C"][0] == whole.obs["C1C"][0]


@pytest.mark.parametrize("interval", ["", "     0.000", "    -1.000"])
def test_an_interval_that_is_none_is_no_fault(interval):
    assert "    10.000 " in GPS_2
    text = GPS_2.replace("    10.000 ", f"{interval:11}", 1)
    assert np.isnan(rinex_obs.parse(text, "x").header.interval_s)


@pytest.mark.parametrize("number", ["99", "  "])
def test_a_frequency_that_is_not_known_is_none(number):
    line = header_line(f"  2 R01 {number} R02  1", "GLONASS SLOT / FRQ #")
    text = MIXED_3.replace(header_line("TEST", "MARKER NAME"), line)
    found = rinex_obs.parse(text, "x").header.frequencies
    assert 1 not in found
    assert found[2] == 1
