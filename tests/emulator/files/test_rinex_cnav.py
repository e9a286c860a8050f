"""Inter-signal corrections: a record by the published layout, and one clear line for every fault."""

from __future__ import annotations

import pytest

from gnss_hil.emulator.files import rinex_cnav, rinex_nav
from gnss_hil.emulator.files.text import FileError
from tests.emulator.files.test_rinex_nav import GPS_2, MIXED_4

pytestmark = pytest.mark.verifies(
    "emulator/files/rinex_cnav.py",
    what="Inter-signal corrections of GPS",
    by="records written by the published layout; no file of a station",
    status="modelled",
)

SHORT = MIXED_4[MIXED_4.index("> EPH G01 CNAV") : MIXED_4.index("> EPH R03 FDMA")]


def record(number, *isc, epoch="2025 06 15 02 30 00"):
    """A record of a satellite whose other values are their places in the file, and its corrections [s]."""
    rows = [[1.0 + line + k / 10 for k in range(4)] for line in range(8)]
    rows[6] = list(isc)
    text = (
        f"> EPH G{number:02d} CNAV\nG{number:02d} {epoch}"
        + "".join(f"{v:19.12E}" for v in (1e-4, 1e-12, 0))
        + "\n"
    )
    for row in rows:
        text += "    " + "".join(" " * 19 if v is None else f"{v:19.12E}" for v in row) + "\n"
    return text


def parse(*records):
    return rinex_cnav.parse(MIXED_4.replace(SHORT, "".join(records)), "x.rnx")


def test_each_satellites_last_record_counts():
    found = parse(
        record(1, 1e-9, -2e-9, 3e-9, -4e-9), record(3, 5e-9, 0, 0, 0), record(1, 6e-9, 7e-9, 8e-9, 9e-9)
    )
    assert found == {
        1: pytest.approx({"L1CA": 6e-9, "L2C": 7e-9, "L5I5": 8e-9, "L5Q5": 9e-9}),
        3: pytest.approx({"L1CA": 5e-9, "L2C": 0, "L5I5": 0, "L5Q5": 0}),
    }


def test_what_stands_for_none_and_blanks_are_left_out():
    """-2^12 of 2^-35 s, 30.3.3.3.1.1.1; a record cut short, as one of a receiver, says nothing."""
    assert parse(record(1, -4096 * 2.0**-35, None, 3e-9, None)) == {1: {"L5I5": 3e-9}}
    assert parse(SHORT) == {}
    assert rinex_cnav.parse(GPS_2, "x") == {}


@pytest.mark.parametrize("value", [1.0, -2e-7])
def test_a_correction_that_no_message_can_have_is_refused(value):
    with pytest.raises(
        FileError, match=r"x\.rnx: line \d+: ISC_L2C is '.*'; allowed is -1.19e-07 to 1.19e-07 s"
    ):
        parse(record(1, 1e-9, value, 0, 0))


def test_the_reader_of_orbits_passes_the_record_over():
    text = MIXED_4.replace(SHORT, record(1, 1e-9, -2e-9, 3e-9, -4e-9))
    assert rinex_nav.parse(text, "x").records["G"].number.tolist() == [1]
