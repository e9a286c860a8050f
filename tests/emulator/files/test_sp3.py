"""The SP3 reader: versions, time systems, joining, and one clear line for every fault."""

from __future__ import annotations

import gzip
from datetime import datetime

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.emulator.files import sp3
from gnss_hil.emulator.files.text import FileError

C_FILE = """\
#cP2009  4  1  0  0  0.00000000       2 ORBIT IGS05 HLM  IGS
## 1525 259200.00000000   900.00000000 54922 0.0000000000000
+    4   G05R11L09E11  0  0  0  0  0  0  0  0  0  0  0  0  0
++         2  2  2  2  0  0  0  0  0  0  0  0  0  0  0  0  0
%c M  cc GPS ccc cccc cccc cccc cccc ccccc ccccc ccccc ccccc
%c cc cc ccc ccc cccc cccc cccc cccc ccccc ccccc ccccc ccccc
%f  1.2500000  1.025000000  0.00000000000  0.000000000000000
%i    0    0    0    0      0      0      0      0         0
/* PCV:IGS05_1525 OL/AL:FES2004  NONE     Y  ORB:CMB CLK:CMB
*  2009  4  1  0  0  0.00000000
PG05  -4778.033657 -25797.446685   3525.551197   -120.499602 14 12 13
VG05  20298.880364  -18462.044804   1381.387685     -4.534317
PR11  18438.437027  16866.988191  -5362.099515 999999.999999
PL09   1828.856677    255.622214   6578.281838 999999.999999
PE11      0.000000      0.000000      0.000000 999999.999999
*  2009  4  1  0 15  0.12345678
PG05  -4780.000001 -25700.000002   3525.000003    120.500000
EOF
"""


def test_version_c():
    """Kilometres and microseconds; velocities passed over; zeros and 999999.999999 are absent."""
    found = sp3.parse(C_FILE, "x")
    start_ns = gpstime.from_calendar(datetime(2009, 4, 1))
    assert found.t_ns.tolist() == [start_ns, start_ns + 900 * gpstime.NS_PER_S + 123_456_780]
    assert found.name == ("E11", "G05", "L09", "R11")
    assert found.pos_ecef_m[0, 1] == pytest.approx((-4778033.657, -25797446.685, 3525551.197), abs=1e-9)
    assert found.pos_ecef_m[0, 2] == pytest.approx((1828856.677, 255622.214, 6578281.838), abs=1e-9)
    assert np.isnan(found.pos_ecef_m[0, 0]).all()
    assert np.isnan(found.pos_ecef_m[1, [0, 2, 3]]).all()
    assert found.clock_s[:, 1] == pytest.approx((-120.499602e-6, 120.5e-6), abs=1e-18)
    assert np.isnan(found.clock_s[0, [0, 2, 3]]).all()


def test_navigation_satellites_are_those_with_a_letter():
    found = sp3.parse(C_FILE, "x")
    index, column = found.navigation()
    assert found.index.tolist() == index.tolist()
    assert index.tolist() == [satellites.parse(name) for name in ("G05", "R11", "E11")]
    assert column.tolist() == [1, 3, 0]


def test_version_a_has_numbers_without_letters():
    text = (
        C_FILE.replace("#c", "#a")
        .replace("M  cc GPS", "cc cc ccc")
        .replace("PG05", "P  5")
        .replace("VG05", "V  5")
    )
    assert sp3.parse(text, "x").name == ("E11", "G05", "L09", "R11")


def test_a_clock_may_be_left_out():
    text = C_FILE.replace("   -120.499602 14 12 13", "")
    assert np.isnan(sp3.parse(text, "x").clock_s[0, 1])


@pytest.mark.parametrize(
    ("scale", "ahead_s"),
    [("GPS", 0), ("GAL", 0), ("QZS", 0), ("UTC", 15), ("GLO", 15), ("TAI", -19), ("BDT", 14)],
)
def test_time_systems(scale, ahead_s):
    """GPS - UTC was 15 s on that day (IERS Bulletin C 36), TAI - GPS is 19 s, GPS - BDT 14 s."""
    found = sp3.parse(C_FILE.replace("cc GPS", f"cc {scale}"), "x")
    assert found.t_ns[0] == gpstime.from_calendar(datetime(2009, 4, 1)) + ahead_s * gpstime.NS_PER_S


@pytest.mark.parametrize("nines", ["999999.999999", " 99999.999999", "  9999.999999", " 99999.000000"])
def test_nothing_but_nines_is_nothing(nines):
    text = C_FILE.replace("   -120.499602", nines.rjust(14))
    assert np.isnan(sp3.parse(text, "x").clock_s[0, 1])
    text = C_FILE.replace("      0.000000      0.000000      0.000000", 3 * nines.rjust(14))
    assert np.isnan(sp3.parse(text, "x").pos_ecef_m[0, 0]).all()


def test_a_clock_of_exactly_nothing_is_none_among_others():
    """Of a satellite whose clock is always so it is told, see `constellation.presence`."""
    text = C_FILE.replace("    120.500000", "      0.000000")
    assert np.isnan(sp3.parse(text, "x").clock_s[1, 1])
    still = sp3.parse(text.replace("   -120.499602", "      0.000000"), "x")
    assert still.clock_s[:, 1].tolist() == [0.0, 0.0]


def test_small_letters_are_satellites():
    assert sp3.parse(C_FILE.replace("PG05", "Pg05"), "x").name == ("E11", "G05", "L09", "R11")


def test_gzip(tmp_path):
    path = tmp_path / "orbits"
    path.write_bytes(gzip.compress(C_FILE.encode()))
    assert sp3.read(path).name == ("E11", "G05", "L09", "R11")


def test_of_two_products_the_later_counts_where_it_has_something_to_say():
    """Overlapping instants, other satellites, absent positions."""
    first = sp3.parse(C_FILE, "a")
    second = sp3.parse(
        C_FILE.replace("  0 15  0.12345678", "  0 30  0.00000000")
        .replace("-4778.033657", "-4778.500000")
        .replace(
            "PR11  18438.437027  16866.988191  -5362.099515", "PR11      0.000000      0.000000      0.000000"
        )
        .replace("PL09", "PG07"),
        "b",
    )
    both = sp3.joined((first, second))
    assert both.origin == "a, b"
    assert both.name == ("E11", "G05", "G07", "L09", "R11")
    assert len(both.t_ns) == 3
    assert both.pos_ecef_m[0, 1, 0] == pytest.approx(-4778500.0)
    assert both.pos_ecef_m[0, 4, 0] == pytest.approx(18438437.027)
    assert np.isfinite(both.pos_ecef_m[:, 1]).all()
    assert np.isfinite(both.pos_ecef_m[0, [2, 3]]).all()
    assert np.isnan(both.pos_ecef_m[1:, [0, 2, 3, 4]]).all()


FAULTS = [
    ("no sp3", "#cP2009", "hello  ", "line 1: not an SP3 file"),
    ("version", "#cP", "#eP", "line 1: not an SP3 file"),
    ("time system", "cc GPS", "cc XYZ", "line 5: time system is 'XYZ'; allowed is GPS, GAL"),
    ("no time system", "%c", "/*", "line 1: the header has no %c line"),
    (
        "epoch",
        "*  2009  4  1  0 15",
        "*  2009 14  1  0 15",
        "line 16: epoch is '2009 14  1  0 15  0.12345678'",
    ),
    (
        "epoch again",
        "  0 15  0.12345678",
        "  0  0  0.00000000",
        "line 16: epoch does not follow the one before",
    ),
    ("x", "-4778.033657", "-4778.03365x", "line 11: x is '-4778.03365x'; allowed is F14.6"),
    ("y", "-25797.446685", "             ", "line 11: y is ''; allowed is F14.6"),
    ("clock", "   -120.499602", "   -12049960.2", "line 11: clock is '-12049960.2'; allowed is F14.6"),
    ("satellite", "PR11", "P?11", "line 13: satellite is '?11'; allowed is such as G07"),
    ("twice", "PR11", "PG05", "line 13: the epoch has G05 already"),
    (
        "position first",
        "*  2009  4  1  0  0  0.0",
        "/* 2009  4  1  0  0  0.0",
        "line 11: a position comes before",
    ),
    ("no end", "EOF\n", "", "line 17: file is cut off; its last line is not EOF"),
]


@pytest.mark.parametrize(("old", "new", "expected"), [f[1:] for f in FAULTS], ids=[f[0] for f in FAULTS])
def test_a_fault_is_one_line_with_file_and_place(old, new, expected):
    assert old in C_FILE
    with pytest.raises(FileError) as caught:
        sp3.parse(C_FILE.replace(old, new), "some.sp3")
    message = str(caught.value)
    assert message.startswith("some.sp3: line ")
    assert expected in message
    assert "\n" not in message


def test_no_cut_of_a_file_is_read():
    """The last line is the promise that nothing is missing."""
    for end in range(1, len(C_FILE) - 2):
        with pytest.raises(FileError, match="x: line "):
            sp3.parse(C_FILE[:end], "x")


@given(st.integers(0, len(C_FILE) - 1), st.characters(max_codepoint=126))
def test_any_character_anywhere_is_read_or_refused_in_words(place, character):
    try:
        sp3.parse(C_FILE[:place] + character + C_FILE[place + 1 :], "x")
    except FileError as error:
        assert str(error).startswith("x: line ")
        assert "\n" not in str(error)


def test_absent_positions_may_be_nines_and_clocks_of_either_sign():
    for place in ("      0.000000      0.000000      0.000000", " 999999.999999 999999.999999 999999.999999"):
        found = sp3.parse(
            C_FILE.replace("  18438.437027  16866.988191  -5362.099515", f"{place:>42}"[:42]), "x"
        )
        assert np.isnan(found.pos_ecef_m[0, 3]).all()
    found = sp3.parse(C_FILE.replace("   -120.499602", "-999999.999999"), "x")
    assert np.isnan(found.clock_s[0, 1])


@pytest.mark.parametrize("name", ["J2000", "ECI", "GCRF", "EME20", "tod", "ICRF2"])
def test_coordinates_that_do_not_turn_with_the_earth_are_refused(name):
    with pytest.raises(FileError, match=f"x: line 1: coordinate system is '{name}'; one that turns"):
        sp3.parse(C_FILE.replace("IGS05", f"{name:5}"), "x")


def test_the_coordinate_system_is_noted_and_known_or_not():
    assert sp3.parse(C_FILE, "x").frame == "IGS05"
    for name in ("IGS20", "IGb14", "ITRF2", "ITR97", "WGS84", "PZ-90", "UNDEF", ""):
        assert sp3.is_earth_fixed(name)
    assert not sp3.is_earth_fixed("XYZ")


def test_other_units_are_refused():
    metres = C_FILE.replace(
        "  18438.437027  16866.988191  -5362.099515", "1843843.7027001686698.819100-536209.951500"
    )
    with pytest.raises(
        FileError, match=r"x: line 13: R11 is 2\.55582e\+06 km from the Earth's centre; allowed is 6200"
    ):
        sp3.parse(metres, "x")


def test_predicted_orbits_are_noted():
    line = "PR11  18438.437027  16866.988191  -5362.099515 999999.999999"
    assert not sp3.parse(C_FILE, "x").predicted.any()
    found = sp3.parse(C_FILE.replace(line, f"{line:79}P"), "x")
    assert found.predicted.tolist() == [True, False]
    for flags in (f"{line:75}P", f"{line:78}M"):
        assert not sp3.parse(C_FILE.replace(line, flags), "x").predicted.any()
    assert sp3.joined([sp3.parse(C_FILE, "x"), found]).predicted.tolist() == [True, False]
    assert not sp3.joined([found, sp3.parse(C_FILE, "x")]).predicted.any()


def test_nothing_goes_on_across_a_manoeuvre_or_a_jump_of_a_clock():
    """Flags of SP3-c, table 1, columns 79 and 75, as a product of an agency has them."""
    line = "PG05  -4780.000001 -25700.000002   3525.000003    120.500000"
    sound, g05 = sp3.parse(C_FILE, "x"), 1
    moved = sp3.parse(C_FILE.replace(line, f"{line:78}M"), "x")
    assert moved.breaks == ((int(sound.t_ns[1]), "G05", "a manoeuvre"),)
    assert np.isnan(moved.pos_ecef_m[1, g05]).all() and moved.clock_s[1, g05] == sound.clock_s[1, g05]
    jumped = sp3.parse(C_FILE.replace(line, f"{line:74}E"), "x")
    assert jumped.breaks == ((int(sound.t_ns[1]), "G05", "a jump of its clock"),)
    assert np.isnan(jumped.clock_s[1, g05]) and (jumped.pos_ecef_m[1] == sound.pos_ecef_m[1])[g05].all()
    assert sound.breaks == () and sp3.joined([sound, moved, moved]).breaks == moved.breaks


def test_a_time_system_in_small_letters_is_read():
    assert (
        sp3.parse(C_FILE.replace(" GPS ", " gps "), "x").t_ns.tolist() == sp3.parse(C_FILE, "x").t_ns.tolist()
    )


def test_how_far_files_disagree_is_noted():
    one, other = sp3.parse(C_FILE, "x"), sp3.parse(C_FILE.replace("  18438.437027", "  18438.537027"), "y")
    assert sp3.joined([one, one]).apart_m == 0
    joined = sp3.joined([one, other])
    assert joined.apart_m == pytest.approx(100, abs=1e-6)
    assert joined.pos_ecef_m[0, 3, 0] == pytest.approx(18_438_537.027)
