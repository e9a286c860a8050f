"""Parameters of the sky's errors: what satellites report of themselves, and what they do not.

Formulas stand in `emulator.error_models.ephemeris_error`, `emulator.error_models.satellite_clock_error` and
`emulator.error_models.code_biases`.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from gnss_hil.emulator.error_models.params import Factor

Sigma = Annotated[float, Field(ge=0, le=1000)]
Triple = tuple[Sigma, Sigma, Sigma]
Period = Annotated[float, Field(ge=60, le=14 * 86400, multiple_of=60)]


class EphemerisError(Factor):
    """Orbits as broadcast.

    gps_sigma_m, glonass_sigma_m    1 sigma radial, along and cross track [m]. Chosen: with the defaults of
                                    `SatelliteClockError` they give the ranging errors of 0.7 m and 1.9 m of
                                    Montenbruck, Steigenberger and Hauschild, GPS Solutions 19 (2015) 321;
                                    how these are shared out among the components is modelled
    gps_upload_s, glonass_upload_s  how long an error lasts [s], whole minutes: GPS is uploaded once a
                                    day; GLONASS is modelled by what broadcast orbits of 2009-04-01 are off,
                                    which lasts through many half-hourly issues
    """

    gps_sigma_m: Triple = (0.2, 1.2, 0.6)
    glonass_sigma_m: Triple = (0.4, 2.8, 1.6)
    gps_upload_s: Period = 86400.0
    glonass_upload_s: Period = 43200.0

    @model_validator(mode="after")
    def _orbits_are_free(self):
        for system in ("gps", "glonass"):
            radial, along, _ = getattr(self, f"{system}_sigma_m")
            if along < 2 * radial:
                raise ValueError(
                    f"{system}_sigma_m: along track {along:g} m is less than twice the radial {radial:g} m; "
                    "a free orbit that oscillates radially does so twice as far along its track"
                )
        return self


class SatelliteClockError(Factor):
    """Clocks as broadcast: what they have done since the last upload, and what the upload was off.

    gps_clock, glonass_clock            kind of clock: "rb", "cs", "maser"
    gps_upload_m, glonass_upload_m      1 sigma of the offset at the upload [m] (modelled, see EphemerisError)
    gps_upload_s, glonass_upload_s      how long an upload serves [s], whole minutes
    """

    gps_clock: Literal["rb", "cs", "maser"] = "rb"
    glonass_clock: Literal["rb", "cs", "maser"] = "cs"
    gps_upload_m: Sigma = 0.6
    glonass_upload_m: Sigma = 1.0
    gps_upload_s: Period = 86400.0
    glonass_upload_s: Period = 43200.0


class CodeBias(Factor):
    """Satellites' delays of the C/A code against the P code that their broadcast clocks belong to.

    sigma_ns    1 sigma over satellites, GPS: that of the values for 28 satellites, December 1999 to
                March 2000, in IGS's cc2noncc (J. Ray), 0.28 m
    p1_c1_ns    satellite name ("G05") -> P1 - C1 [ns] as monthly files have it, instead of a draw
    """

    sigma_ns: Annotated[float, Field(ge=0, le=1000)] = 0.94
    p1_c1_ns: dict[
        Annotated[str, Field(pattern=r"^G(0[1-9]|[1-5]\d|6[0-3])$")],
        Annotated[float, Field(ge=-1000, le=1000)],
    ] = Field(default_factory=dict)
