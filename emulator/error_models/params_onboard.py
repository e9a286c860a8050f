"""Parameters of what the on-board computer knows: attitude and time. Formulas: `emulator.sensors`."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from gnss_hil.emulator.error_models.params import Factor


class AttitudeError(Factor):
    """Rate gyros, and a star sensor that corrects them. All defaults are modelled: a gyro of navigation grade
    and a sensor of some arc seconds.

    angle_walk_deg_rth      noise of the gyros' rate: angle random walk [deg / sqrt(h)]
    drift_walk_deg_h_rth    how their drift wanders: rate random walk [deg / h / sqrt(h)]
    star_interval_s         how often the star sensor tells the attitude [s]; 0: never
    star_sigma_arcsec       1 sigma of it, each axis
    initial_deg, initial_drift_deg_h   1 sigma of attitude and drift at the start, each axis, where no star
                            sensor helps; with one, filter and sensor have long settled
    """

    angle_walk_deg_rth: Annotated[float, Field(ge=0, le=10)] = 0.003
    drift_walk_deg_h_rth: Annotated[float, Field(ge=0, le=100)] = 0.005
    star_interval_s: Annotated[float, Field(ge=0, le=86400)] = 60.0
    star_sigma_arcsec: Annotated[float, Field(gt=0, le=36000)] = 10.0
    initial_deg: Annotated[float, Field(ge=0, le=10)] = 0.05
    initial_drift_deg_h: Annotated[float, Field(ge=0, le=100)] = 0.02


class OnboardClock(Factor):
    """The clock that the time mark is read from. Defaults are modelled: a quartz clock set to a microsecond.

    offset_us   at the start, ahead of GPS time where positive
    drift_ppb   rate, 1e-9, fast where positive
    walk        Allan deviation at 1 s of white noise of frequency; 0: none
    """

    offset_us: Annotated[float, Field(ge=-1e6, le=1e6)] = 1.0
    drift_ppb: Annotated[float, Field(ge=-1e5, le=1e5)] = 10.0
    walk: Annotated[float, Field(ge=0, le=1e-6)] = 1e-10
