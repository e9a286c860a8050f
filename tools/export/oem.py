"""CCSDS orbit ephemeris messages, keyword = value notation.

A segment ends where states are missing, so that no reader interpolates across a gap. The frame is WGS-84,
which the standard does not list; it is within centimetres of the listed ITRF2000, and the message names both.
Source: CCSDS 502.0-B-2 (Orbit Data Messages, 2009), 5, 6 and annex A
"""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.export.time_series import TimeSeries

FRAME = "ITRF2000"
_GAP = 1.5
"""A step longer than this many of the usual ones is a gap."""


def _epoch(t_ns: int) -> str:
    """UTC of GPS time t_ns; more readers know it than know GPS time."""
    moment = gpstime.to_calendar(t_ns - gpstime.leap_seconds(t_ns) * gpstime.NS_PER_S)
    return f"{moment:%Y-%m-%dT%H:%M:%S}.{t_ns % gpstime.NS_PER_S:09d}"


def text_of(one: TimeSeries) -> Iterator[str]:
    """The message of one craft; Mistake if there is no state with a velocity."""
    moving = np.flatnonzero(~np.isnan(one.velocity_mps).any(axis=1))
    if not len(moving):
        raise Mistake(f"craft {one.name}: no position with a velocity; an OEM needs both")
    t_ns = one.t_ns[moving]
    states = np.concatenate((one.position_m[moving], one.velocity_mps[moving]), axis=1) / 1e3
    yield "CCSDS_OEM_VERS = 2.0\n"
    yield f"COMMENT {one.source}, centre of mass\n"
    yield f"CREATION_DATE = {datetime.now(UTC):%Y-%m-%dT%H:%M:%S}\n"
    yield "ORIGINATOR = GNSS-HIL\n"
    steps = np.diff(t_ns)
    cuts = np.flatnonzero(steps > _GAP * np.median(steps)) + 1 if len(steps) else []
    for rows in np.split(np.arange(len(t_ns)), cuts):
        yield from _segment(one, t_ns[rows].tolist(), states[rows].tolist())


def _segment(one: TimeSeries, t_ns: list[int], states: list[list[float]]) -> Iterator[str]:
    yield (
        "\nMETA_START\n"
        "COMMENT the axes are those of WGS-84\n"
        f"OBJECT_NAME = {one.name}\n"
        f"OBJECT_ID = {one.name}\n"
        "CENTER_NAME = EARTH\n"
        f"REF_FRAME = {FRAME}\n"
        "TIME_SYSTEM = UTC\n"
        f"START_TIME = {_epoch(t_ns[0])}\n"
        f"STOP_TIME = {_epoch(t_ns[-1])}\n"
        "META_STOP\n\n"
    )
    for t, (x, y, z, vx, vy, vz) in zip(t_ns, states, strict=True):
        yield f"{_epoch(t)} {x:.7f} {y:.7f} {z:.7f} {vx:.10f} {vy:.10f} {vz:.10f}\n"
