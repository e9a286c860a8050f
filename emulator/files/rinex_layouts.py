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

GLONASS_MORE = ("status", "delta_tau", "urai", "health_flags")
"""Of the fifth line; zero where there is none."""

MAY_BE_BLANK = {
    "codes_l2", "week", "l2p_flag", "iodc", "transmission", "fit_h", "message_time", "age_days",
    *GLONASS_MORE,
}  # fmt: skip

UNKNOWN = 0.9999e9
"""From here on a field that may be blank is unknown: RINEX writes .9999E9 and .999999999999E+09 for it (2.11,
tables A4 and A11; 3.05, tables A6 and A10)."""


UPLOADED = {"transmission", "message_time"}
"""Fields that say when a record was sent: nan where it is unknown, since 0 is a time."""


@dataclass(frozen=True, slots=True)
class Layout:
    """How a system's record is written.

    message what version 4 calls the message
    lines   how many a record may have
    bytes   fields that some receivers write as unsigned bytes: 253 is -3
    ranges  field -> least and greatest value that a satellite can have
    place   fields that are not all zero where a satellite has a place
    more    fields of the longest record's last line; unknown and missing ones are zero
    """

    name: str
    message: str
    fields: tuple[str, ...]
    lines: tuple[int, ...]
    bytes: tuple[str, ...]
    ranges: dict[str, tuple[float, float]]
    place: tuple[str, ...]
    more: tuple[str, ...] = ()

    @property
    def may_be_blank(self) -> tuple[int, ...]:
        """Positions of the fields that may be blank or unknown."""
        return tuple(k for k, name in enumerate(self.fields) if name in MAY_BE_BLANK)


def _within(most: float, *names: str) -> dict[str, tuple[float, float]]:
    return {name: (-most, most) for name in names}


_GPS_RANGES = {
    "e": (0, 0.5),
    "sqrt_a": (2600, 9000),
    "toe": (0, 604_800),
    **_within(0.1, "af0"),
    **_within(1e-6, "af1", "tgd"),
    **_within(1e-10, "af2"),
    **_within(10.0, "m0", "omega0", "omega", "i0"),
    **_within(1e-4, "delta_n", "omega_dot", "idot"),
    **_within(0.01, "cuc", "cus", "cic", "cis"),
    **_within(1e5, "crc", "crs"),
}
_GLONASS_RANGES = {
    "frequency": (-7, 13),
    **_within(0.1, "minus_tau"),
    **_within(1e-6, "gamma", "delta_tau"),
    **_within(1e5, "x_km", "y_km", "z_km"),
    **_within(10.0, "vx_kmps", "vy_kmps", "vz_kmps"),
    **_within(1e-4, "ax_kmps2", "ay_kmps2", "az_kmps2"),
}
"""Some ten times what messages can express, or more: no satellite is beyond."""

LAYOUTS = {
    "G": Layout("GPS", "LNAV", GPS_FIELDS, (8,), (), _GPS_RANGES, ("e", "sqrt_a", "m0", "i0")),
    "R": Layout(
        "GLONASS",
        "FDMA",
        GLONASS_FIELDS,
        (4, 5),
        ("frequency",),
        _GLONASS_RANGES,
        ("x_km", "y_km", "z_km"),
        GLONASS_MORE,
    ),
}
"""By RINEX letter. GLONASS has a fifth line (accuracy, group delay) from version 3.05 on."""
