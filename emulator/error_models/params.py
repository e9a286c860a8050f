"""What the parameters of every error model have in common."""

from __future__ import annotations

from gnss_hil.dbc.common.vehicle import Strict


class Factor(Strict):
    """Parameters of a model; `enabled = false` switches it off."""

    enabled: bool = True
