"""How RINEX writes the records of each system: tables, nothing else.

Sources: RINEX 2.11 (Gurtner & Estey, 2007), tables A4 and A11; RINEX 3.05 (IGS/RTCM, 2020), tables A6 and
A10; RINEX 4.01 (IGS/RTCM, 2023), tables of GPS LNAV and GLONASS FDMA
"""

from __future__ import annotations

from dataclasses import dataclass

GPS_FIELDS = (
    "af0", "af1", "af2",
    "iode", "crs", "delta_n", "m0",
    "cuc", "e", "cus", "sqrt_a",
    "toe", "cic", "omega0", "cis",
    "i0", "crc", "omega", "omega_dot",
    "idot", "codes_l2", "week", "l2p_flag",
    "ura_m", "health", "tgd", "iodc",
    "transmission", "fit_h",
)  # fmt: skip
GLONASS_FIELDS = (
    "minus_tau", "gamma", "message_time",
    "x_km", "vx_kmps", "ax_kmps2", "health",
    "y_km", "vy_kmps", "ay_kmps2", "frequency",
    "z_km", "vz_kmps", "az_kmps2", "age_days",
)  # fmt: skip
"""Fields of a record in file order: three on the epoch's line, then four a line."""

MAY_BE_BLANK = {"codes_l2", "week", "l2p_flag", "iodc", "transmission", "fit_h", "message_time", "age_days"}


@dataclass(frozen=True, slots=True)
class Layout:
    """How a system's record is written.

    message what version 4 calls the message
    lines   how many a record may have
    bytes   fields that some receivers write as unsigned bytes: 253 is -3
    ranges  field -> least and greatest value with which an orbit or a frequency can be computed at all
    """

    name: str
    message: str
    fields: tuple[str, ...]
    lines: tuple[int, ...]
    bytes: tuple[str, ...]
    ranges: dict[str, tuple[float, float]]


LAYOUTS = {
    "G": Layout("GPS", "LNAV", GPS_FIELDS, (8,), (), {"e": (0, 0.5), "sqrt_a": (2600, 9000)}),
    "R": Layout("GLONASS", "FDMA", GLONASS_FIELDS, (4, 5), ("frequency",), {"frequency": (-7, 13)}),
}
"""By RINEX letter. GLONASS has a fifth line (accuracy, group delay) from version 3.05 on."""
