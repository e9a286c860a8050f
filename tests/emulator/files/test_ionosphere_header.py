"""Coefficients of the ionosphere in headers: what is written is what is read; faults in one line."""

from __future__ import annotations

import re

import pytest

from gnss_hil.emulator.files import ionosphere_header
from gnss_hil.emulator.files.text import FileError


def line(text, label):
    return f"{text:<60}{label}\n"


HEAD_2 = line("     2.11           N: GPS NAV DATA", "RINEX VERSION / TYPE")
HEAD_3 = line("     3.05           N: GNSS NAV DATA    M: MIXED", "RINEX VERSION / TYPE")
END = line("", "END OF HEADER")
TWO = (
    HEAD_2
    + line("    0.1676D-07 -0.7451D-08 -0.1192D-06  0.1192D-06", "ION ALPHA")
    + line("    0.1188D+06 -0.6554D+05 -0.3277D+06  0.3277D+06", "ION BETA")
    + END
)
THREE = (
    HEAD_3
    + line("GAL    2.5500E+01 -1.4063E-01  1.0010E-02  0.0000E+00", "IONOSPHERIC CORR")
    + line("GPSA   1.6760E-08 -7.4510E-09 -1.1920E-07  1.1920E-07", "IONOSPHERIC CORR")
    + line("GPSB   1.1880E+05 -6.5540E+04 -3.2770E+05  3.2770E+05", "IONOSPHERIC CORR")
    + END
)


@pytest.mark.parametrize("text", [TWO, THREE])
def test_both_versions_say_the_same(text):
    """Header of CDDIS' brdc3050.12n, and the same in version 3's columns."""
    header = ionosphere_header.parse(text, "x")
    assert header.alpha == (1.676e-8, -7.451e-9, -1.192e-7, 1.192e-7)
    assert header.beta == (118800.0, -65540.0, -327700.0, 327700.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (TWO.replace("ION ALPHA", "COMMENT  "), "nav: header has no ION ALPHA or IONOSPHERIC CORR GPSA"),
        (
            TWO.replace("-0.7451D-08", "-0.7x51D-08"),
            "nav: line 2: ION ALPHA 1 is '-0.7x51D-08', not a number",
        ),
        (
            TWO.replace("-0.3277D+06  0.3277D+06", "-0.3277D+06            "),
            "nav: line 3: ION BETA 3 is '', not a number",
        ),
        (
            THREE.replace("GPSB   1.1880E+05", "GPSB          nan"),
            "nav: line 4: GPSB 0 is 'nan', not a number",
        ),
        (
            re.sub(r"[- ]0\.\d{4}D[-+]\d\d", " 0.0000D+00", TWO),
            "nav: all coefficients of the ionosphere are 0: none were received",
        ),
        (TWO.replace(END, ""), "nav: line 3: file ends inside the header"),
        ("hello\n", "nav: line 1: not a RINEX file (no RINEX VERSION / TYPE in columns 61-80)"),
    ],
)
def test_faults_are_reported_in_one_line(text, message):
    with pytest.raises(FileError) as error:
        ionosphere_header.parse(text, "nav")
    assert str(error.value).startswith(message) and "\n" not in str(error.value)
