"""Least power of ranging signals on the ground: one row for each that emulated satellites transmit.

Blocks that keep a higher promise say so in `gnss_hil.emulator.constellation.block_types`.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Power:
    """received_dbw  what an isotropic circularly polarised antenna on the ground receives at least from a
    satellite 5 deg high [dBW]. Interface documents give it for a 3 dBi linearly polarised one, which takes
    half of a circular wave: the same number."""

    received_dbw: float
    source: str


POWERS: dict[str, Power] = {
    "L1CA": Power(-158.5, "IS-GPS-200, table 3-Va"),
    "L2C": Power(-160.0, "IS-GPS-200, table 3-Va: blocks IIR-M and IIF, CM and CL together"),
    "L5": Power(-157.9, "IS-GPS-705, table 3-III: block IIF, the quadrature component alone"),
    "L1OF": Power(-161.0, "GLONASS ICD 5.1 (2008), 3.3.1.6"),
    "L2OF": Power(-167.0, "GLONASS ICD 5.1 (2008), 3.3.1.6: GLONASS-M"),
}
"""By name of the signal (`gnss_hil.dbc.common.signals`)."""
