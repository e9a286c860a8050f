"""Units of keys: a key's name ends with its unit."""

from __future__ import annotations

UNITS = {
    "s": "s",
    "ms": "ms",
    "ns": "ns",
    "m": "m",
    "km": "km",
    "m2": "m²",
    "kg": "kg",
    "k": "K",
    "deg": "deg",
    "dps": "deg/s",
    "hz": "Hz",
    "mhz": "MHz",
    "db": "dB",
    "dbi": "dBi",
    "dbw": "dBW",
    "dbhz": "dB-Hz",
    "chips": "chips",
    "ppb": "1e-9",
    "body": "body axes",
    "per_channel": "m per frequency number",
    "per_hour": "1/h",
    "mps": "m/s",
    "epochs": "epochs",
    "us": "us",
    "arcsec": "arcsec",
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
