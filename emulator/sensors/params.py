"""What the parameters of every sensor have in common."""

from __future__ import annotations

from gnss_hil.dbc.common.vehicle import Strict


class SensorParams(Strict):
    """Parameters of a sensor; `enabled = false` takes its node off the bus."""

    enabled: bool = True
