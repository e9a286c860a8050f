"""Observation files by the published layout, as texts."""

from __future__ import annotations


def header_line(text, label):
    return f"{text:<60}{label}\n"


def _values(*fields):
    """Fields (value, loss of lock, strength) of F14.3, I1, I1; None is blank."""
    return "".join(" " * 16 if f is None else f"{f[0]:14.3f}{f[1]}{f[2]}" for f in fields)


GPS_2 = (
    header_line("     2.20           OBSERVATION DATA    G (GPS)", "RINEX VERSION / TYPE")
    + header_line("GRACE B", "MARKER NAME")
    + header_line("  4000000.1000  -500000.2000  4900000.3000", "APPROX POSITION XYZ")
    + header_line("        0.1000        0.2000        0.3000", "ANTENNA: DELTA H/E/N")
    + header_line("1                   BLACKJACK           2.0", "REC # / TYPE / VERS")
    + header_line("1                   CHOKE RING", "ANT # / TYPE")
    + header_line("     1     1", "WAVELENGTH FACT L1/2")
    + header_line("     1     2     1   G07", "WAVELENGTH FACT L1/2")
    + header_line("     9    L1    L2    C1    P1    P2    LA    SA    S1    S2", "# / TYPES OF OBSERV")
    + header_line("    10.000", "INTERVAL")
    + header_line("  2010     7    27     0     0    0.0000000     GPS", "TIME OF FIRST OBS")
    + header_line("", "END OF HEADER")
    + " 10  7 27  0  0  0.0000000  0  2  9G11".ljust(68)
    + "  .000000123\n"
    + _values((107576007.037, 4, 8), (83825474.871, 4, 8), (20471032.921, 4, 9), None, (20471037.276, 4, 8))
    + "\n"
    + _values((107576003.542, 5, 9), (669.0, 4, 9), None, (320.0, 4, 8)).rstrip()
    + "\n"
    + _values((-112972191.775, 4, 8), None, (21497892.818, 4, 8), (21497893.313, 4, 8), (21497897.589, 4, 8))
    + "\n"
    + _values((112972189.284, 4, 8)).rstrip()
    + "\n"
    + " 10  7 27  0  0 10.0000001  1  1G11\n"
    + _values((107765767.230, 1, 8)).rstrip()
    + "\n\n"
)
"""A spaceborne receiver's; a blank letter, blank fields, lines cut short, a satellite with half waves."""

MIXED_3 = (
    header_line("     3.05           OBSERVATION DATA    M", "RINEX VERSION / TYPE")
    + header_line("TEST", "MARKER NAME")
    + header_line("G    5 C1C L1C D1C S1C C2W", "SYS / # / OBS TYPES")
    + header_line("R    2 C1C L1C", "SYS / # / OBS TYPES")
    + header_line("E    1 C1X", "SYS / # / OBS TYPES")
    + header_line("R  100  1 L1C", "SYS / SCALE FACTOR")
    + header_line("  2 R03  5 R21 -4", "GLONASS SLOT / FRQ #")
    + header_line("     1", "RCV CLOCK OFFS APPL")
    + header_line("     1.000", "INTERVAL")
    + header_line("  2012    10    31    00    15    0.0000000     GPS", "TIME OF FIRST OBS")
    + header_line("", "END OF HEADER")
    + "> 2012 10 31 00 15  0.0000000  0  4        .000000001234\n"
    + "G07"
    + _values((23456789.012, " ", 7), (123266789.123, 2, 7), (-1234.567, " ", " "), (45.25, " ", " "))
    + "\nR21"
    + _values((19456789.012, " ", 7), (10399900.0, 1, 7))
    + "\nE11"
    + _values((25456789.012, " ", 7))
    + "\nL12"
    + _values((25456789.012, " ", 7))
    + "\n> 2012 10 31 00 15  1.0000000  0  1\n"
    + "G07"
    + _values((23456790.012, " ", 7), None, None, None, (23456791.5, " ", 6))
    + "\n"
)
"""Three systems with codes of their own, phases of GLONASS times 100, a satellite of none the bench knows."""


KNOWN_3 = MIXED_3.replace("  0  4  ", "  0  3  ").replace("L12" + _values((25456789.012, " ", 7)) + "\n", "")
"""The same without that satellite, which compact RINEX cannot tell either."""


def version_3_tags_in(scale):
    return MIXED_3.replace("0.0000000     GPS", f"0.0000000     {scale}")
