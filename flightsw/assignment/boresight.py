"""Blocks 5 and 6 of RU 2706636 C1, step 6: boresight directions in the Greenwich frame."""

from __future__ import annotations

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.flightsw.attitude.attitude import Attitude


def boresights_ecef(attitude: Attitude, boresight_body: F64) -> F64:
    """l_ecef = A^T l, (m, 3) unit vectors; boresight_body (m, 3) is the setter, block 6: the vehicle file."""
    return boresight_body @ attitude.dcm_body_from_ecef
