"""Ionospheres of low and high solar activity.

Coefficients are broadcasts of such days. Profiles are modelled: round numbers such that a tenth of the
content lies above 1,336 km, as JASON-1 found by day (E. Yizengaw et al., J. Atm. Solar-Terr. Phys. 70 (2008)
1541: 10 % by day to 60 % by night), and that scale heights grow with activity (L. Liu et al., Ann. Geophys.
24 (2006) 851).
NeQuick G was known when they were chosen: it lies beside them in the tests, and judges nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

from gnss_hil.emulator.signal.ionosphere.klobuchar import Coefficients
from gnss_hil.emulator.signal.ionosphere.profile import Profile


@dataclass(frozen=True, slots=True)
class Preset:
    coefficients: Coefficients
    profile: Profile
    source: str


PRESETS = {
    "low": Preset(
        Coefficients(
            (0.1211e-7, -0.7451e-8, -0.5960e-7, 0.1192e-6), (0.1167e6, -0.2458e6, -0.6554e5, 0.1114e7)
        ),
        Profile(300e3, 40e3, 65e3, 2_500e3, 0.15),
        "GPS broadcast of 2022-01-01 (header of CDDIS' brdc0010.22n)",
    ),
    "high": Preset(
        Coefficients((0.3820e-7, 0.1490e-7, -0.1790e-6, 0.0), (0.1430e6, 0.0, -0.3280e6, 0.1130e6)),
        Profile(350e3, 50e3, 80e3, 2_500e3, 0.15),
        "GPS broadcast of week 1042 (December 1999), of libswiftnav's published example",
    ),
}
