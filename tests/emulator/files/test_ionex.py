"""IONEX reader: what is written is what is read; faults in one line."""

from __future__ import annotations

import gzip
from datetime import datetime

import numpy as np
import pytest

from gnss_hil.emulator.files import ionex
from gnss_hil.emulator.files.text import FileError


def line(text, label):
    return f"{text:<60}{label}\n"


LON = np.arange(-180, 181, 20)


def row(lat, values):
    text = line(f"  {lat:6.1f}-180.0 180.0  20.0 450.0", "LAT/LON1/LON2/DLON/H")
    cells = [f"{v:5d}" for v in values]
    return text + "".join("".join(cells[k : k + 16]) + "\n" for k in range(0, len(cells), 16))


def a_map(number, epoch, values, kind="TEC", exponent=""):
    return (
        line(f"{number:6d}", f"START OF {kind} MAP")
        + line(epoch, "EPOCH OF CURRENT MAP")
        + exponent
        + "".join(row(lat, v) for lat, v in zip((40, 0, -40), values, strict=True))
        + line(f"{number:6d}", f"END OF {kind} MAP")
    )


VALUES = np.arange(3 * 19).reshape(3, 19) * 7
HEAD = (
    line("     1.0            IONOSPHERE MAPS     GPS", "IONEX VERSION / TYPE")
    + line("     2", "# OF MAPS IN FILE")
    + line("  6371.0", "BASE RADIUS")
    + line("     2", "MAP DIMENSION")
    + line("   450.0 450.0   0.0", "HGT1 / HGT2 / DHGT")
    + line("    40.0 -40.0 -40.0", "LAT1 / LAT2 / DLAT")
    + line("  -180.0 180.0  20.0", "LON1 / LON2 / DLON")
    + line("    -1", "EXPONENT")
    + line("   01    -7.516     0.007", "PRN / BIAS / RMS")
    + line("", "END OF HEADER")
)
GAP = VALUES.copy()
GAP[1, 4] = 9999
FIRST = a_map(1, "  2017     1     1    22     0     0", VALUES)
SECOND = a_map(2, "  2017     1     1    24     0     0", GAP, exponent=line("     0", "EXPONENT"))
ERRORS = a_map(1, "  2017     1     1    22     0     0", VALUES, kind="RMS")
TEXT = HEAD + FIRST + SECOND + ERRORS + line("", "END OF FILE")


def test_reads_what_is_written(tmp_path):
    path = tmp_path / "maps.i.gz"
    path.write_bytes(gzip.compress(TEXT.encode()))
    maps = ionex.read(path)
    assert maps.epoch == (datetime(2017, 1, 1, 22), datetime(2017, 1, 2))
    assert maps.lat_deg.tolist() == [40, 0, -40] and maps.lon_deg.tolist() == LON.tolist()
    assert maps.vtec_tecu[0] == pytest.approx(VALUES * 0.1)
    assert np.isnan(maps.vtec_tecu[1, 1, 4]) and np.isnan(maps.vtec_tecu).sum() == 1
    assert maps.vtec_tecu[1, 2] == pytest.approx(VALUES[2])
    assert (maps.height_km, maps.base_radius_km) == (450.0, 6371.0)


def test_the_last_line_may_be_missing():
    """IGS' combined maps of 2010 end without it."""
    assert len(ionex.parse(HEAD + FIRST + SECOND + ERRORS, "x").epoch) == 2


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("IONEX VERSION / TYPE", "RINEX VERSION / TYPE", "line 1: not an IONEX file"),
        ("     1.0 ", "     x.0 ", "line 1: IONEX VERSION / TYPE is 'x.0', not a number"),
        ("     1.0 ", "     2.0 ", "line 1: IONEX version and type are 2 and 'I'; 1 and 'I' are read"),
        ("LAT1 / LAT2 / DLAT", "COMMENT", "header has no LAT1 / LAT2 / DLAT"),
        (
            "    40.0 -40.0 -40.0",
            "    40.0 -40.0   0.0",
            "line 6: LAT1 / LAT2 / DLAT is 40.0 / -40.0 / 0.0: not a",
        ),
        ("     2  ", "     3  ", "MAP DIMENSION is not 2"),
        (FIRST, "", "line 36: 1 maps of content; # OF MAPS IN FILE is 2"),
        ("  133  140", "  133  1x0", "line 17: TEC is '1x0', not a whole number"),
        ("  133  140", "  133  nan", "line 17: TEC is 'nan', not a whole number"),
        ("    22     0     0", "    25     0     0", "line 12: EPOCH OF CURRENT MAP is"),
        ("     0.0-180.0 180.0", "    10.0-180.0 180.0", "line 16: LAT is 10; by the header 0 follows"),
        (line("", "END OF FILE"), "junk\n", "line 48: expected START OF a map or END OF FILE"),
    ],
)
def test_faults_are_reported_in_one_line(old, new, message):
    assert old in TEXT
    with pytest.raises(FileError) as error:
        ionex.parse(TEXT.replace(old, new, 1 if old != "     2  " else 2), "maps")
    assert str(error.value).startswith("maps: ") and message in str(error.value)
    assert "\n" not in str(error.value)


def test_every_cut_is_read_or_refused_in_words():
    lines = TEXT.splitlines(keepends=True)
    whole = 0
    for count in range(1, len(lines)):
        try:
            ionex.parse("".join(lines[:count]), "maps")
            whole += 1
        except FileError as error:
            assert str(error).startswith("maps: ")
    assert whole <= len(ERRORS.splitlines()) + 1


@pytest.mark.parametrize(("value", "tecu"), [(-999, "-99.9"), (99999, "9999.9")])
def test_content_that_is_none_is_refused(value, tecu):
    odd = VALUES.copy()
    odd[2, 3] = value
    text = TEXT.replace(FIRST, a_map(1, "  2017     1     1    22     0     0", odd))
    message = (
        f"x: line .*: map of 2017-01-01T22:00 has {tecu} TECU in its row 3; allowed is -10 to 1000, and 9999"
    )
    with pytest.raises(FileError, match=message):
        ionex.parse(text, "x")


def test_labels_may_be_of_small_letters():
    small = "\n".join(text[:60] + text[60:].lower() for text in TEXT.splitlines())
    found, whole = ionex.parse(small, "x"), ionex.parse(TEXT, "x")
    assert found.epoch == whole.epoch
    assert np.array_equal(found.vtec_tecu, whole.vtec_tecu, equal_nan=True)
