"""Units of keys: a key's name ends with its unit."""

from __future__ import annotations

_AS_WRITTEN = "s ms us ns mm m km kg K deg Hz MHz dB dBi dBW chips epochs arcsec"

UNITS = {unit.lower(): unit for unit in _AS_WRITTEN.split()} | {
    "m2": "m²",
    "dps": "deg/s",
    "dbhz": "dB-Hz",
    "ppb": "1e-9",
    "body": "body axes",
    "per_channel": "m per frequency number",
    "per_hour": "1/h",
    "mps": "m/s",
    "mps_rts": "m/s/√s",
    "deg_h": "deg/h",
    "deg_rth": "deg/√h",
    "deg_h_rth": "deg/h/√h",
}
"""Ending of a key -> unit; longer endings first where two fit."""

ODD = {
    "cross_polar_db": "dB",
    "alpha": "s, s/semicircle, ...",
    "beta": "s, s/semicircle, ...",
}
"""Keys whose name does not tell."""


def unit(key: str) -> str:
    """The unit of a key; empty if it has none."""
    if key in ODD:
        return ODD[key]
    fitting = [ending for ending in UNITS if key == ending or key.endswith(f"_{ending}")]
    return UNITS[max(fitting, key=len)] if fitting else ""
