"""The sensor nodes there are: the only list of them, in the order in which they send."""

from __future__ import annotations

from gnss_hil.dbc.common.registry import table
from gnss_hil.emulator.sensors import attitude
from gnss_hil.emulator.sensors.base import Row

SENSORS: dict[str, Row] = table(attitude.ROW)
