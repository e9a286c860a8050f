"""Options that every policy has."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from gnss_hil.dbc.common.vehicle import Strict


class AssignmentOptions(Strict):
    ray_height_km: Annotated[float, Field(ge=0, le=2000, description="lowest ray above the ellipsoid")] = 50.0
