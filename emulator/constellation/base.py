"""The protocol of every constellation, whatever its ephemerides."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from gnss_hil.dbc.common.arrays import F64, I64, Bool

EXACT, PRECISE, WITHOUT_GROUP_DELAY, NO_ACCURACY = -15, -8, 2, 15
"""Accuracy indices: a centimetre or better; 0.125 m, some centimetres of a final orbit and a decimetre that
clocks wander between the quarters of an hour that products have (modelled); 4 m; no prediction. Source:
IS-GPS-200, 30.3.3.1.1.4 and 20.3.3.3.1.3
"""


@dataclass(frozen=True, slots=True, eq=False)
class Broadcast:
    """What satellites broadcast in some segments of time; (s, n) each.

    available  an ephemeris is valid
    healthy    as broadcast
    frequency  GLONASS frequency number -7..+6, else 0
    iod        issue of data: GPS IODE, GLONASS tb index (quarters of an hour of the day)
    ura        user range accuracy index, IS-GPS-200 20.3.3.3.1.3, below 0 30.3.3.1.1.4
    ephemeris  number of the ephemeris in use: another one for each ephemeris of a satellite
    group_delay_m   inside the clock for L1 C/A: GPS c T_GD [m], else 0; other signals contain other multiples
    band_delay_m    by which L2 leaves later than L1, that of clocks: GLONASS c Delta tau_n [m]; else 0
    """

    available: Bool
    healthy: Bool
    frequency: I64
    iod: I64
    ura: I64
    ephemeris: I64
    group_delay_m: F64
    band_delay_m: F64


class Constellation(Protocol):
    """One system's satellites.

    index   (n,) satellite index, `gnss_hil.dbc.common.satellites`
    sample  middles_ns (s,) of segments and nodes_s (k,) relative to them ->
            positions (s, k, n, 3) [m], WGS-84 ECEF of each node's instant, antenna phase centre;
            clocks (s, k, n) [m], the contract's clock_m; and what the satellites broadcast, (s, n).
            Where nothing is available, numbers are finite and without meaning.
    """

    @property
    def index(self) -> I64: ...

    def sample(self, middles_ns: I64, nodes_s: F64) -> tuple[F64, F64, Broadcast]: ...


ReportErrors = Callable[[I64, F64, F64, F64], tuple[F64 | float, F64 | float]]
"""An error of what all satellites of a sky report: middles_ns (s,), nodes_s (k,), true positions and
velocities (s, k, n, 3) -> reported minus true positions (s, k, n, 3) [m] and clocks (s, k, n) [m]."""


class Spanned(Constellation, Protocol):
    """A constellation of files, which end."""

    @property
    def span_ns(self) -> tuple[int, int]:
        """First and last GPS time at which any satellite is known [ns]."""
        ...
