"""What the orbits that satellites broadcast are off: another orbit close by, new at each upload.

A prediction that starts a little wrong goes on as a free orbit, so that between uploads its error is free
motion relative to the true orbit: an ellipse of the period of the orbit, twice as long along the track as
radially, about a point ahead or behind; and a swing across the track. Amplitudes are drawn for each satellite
and upload, in phases that make every instant as uncertain as any other. A radial offset that lasts would
drift along the track; there is none (modelled), nor a change at the issues between uploads, which the fit of
broadcast elements makes centimetres.

Source of the motion: Clohessy & Wiltshire, J. Aerospace Sciences 27 (1960) 653; of its predominance in the
errors of orbits: Colombo, J. Geophys. Res. 94 (1989) 9167
"""

from __future__ import annotations

import numpy as np
from pydantic import model_validator

from gnss_hil.dbc.common import satellites, systems
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.constellation.uploads import MINUTE_NS, by_number, uploads
from gnss_hil.emulator.earth.constants import MU_M3PS2
from gnss_hil.emulator.error_models import broadcast
from gnss_hil.emulator.error_models.base import ReportInput, ReportTerm
from gnss_hil.emulator.error_models.broadcast import Period, Sigma
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.numerics.keyed_draws import SKY_KEY, Stream
from gnss_hil.emulator.signal.geometry import spin

Triple = tuple[Sigma, Sigma, Sigma]


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


def errors(
    parameters: EphemerisError,
    seed: int,
    index: I64,
    middles_ns: I64,
    nodes_s: F64,
    pos_ecef_m: F64,
    vel_ecef_mps: F64,
) -> F64:
    """Reported minus true positions (s, k, n, 3) [m], ECEF, of satellites index (n,).

    middles_ns (s,)  middles of minutes of GPS time [ns];  nodes_s (k,) relative to them [s]
    pos_ecef_m, vel_ecef_mps (s, k, n, 3)  true, at the nodes
    Satellites of systems without parameters report the truth.
    """
    sigma_m, mean_motion = _by_satellite(parameters, index)
    minute = middles_ns // MINUTE_NS
    plan = uploads(seed, index, broadcast.by_system(parameters, "upload_s"))
    number = plan.number(minute)
    drawn = by_number(Stream(seed, SKY_KEY, "ephemeris_error"), number, index, 5)[:, None]
    age_s = 60.0 * (minute[:, None] - plan.begun(number)) + 30.0
    radial, along, cross = free_motion(drawn, sigma_m, mean_motion * (age_s[:, None] + nodes_s[:, None]))
    up, ahead, aside = orbital_axes(pos_ecef_m, vel_ecef_mps)
    return radial[..., None] * up + along[..., None] * ahead + cross[..., None] * aside


def _by_satellite(parameters: EphemerisError, index: I64) -> tuple[F64, F64]:
    """1 sigma (n, 3) [m] and mean motion (n,) [rad/s]."""
    system = satellites.system_of(index)
    radius_m = {row.value: row.orbit_radius_m for row in systems.tracked()}
    sigma_m, mean_motion = np.zeros((len(index), 3)), np.zeros(len(index))
    for value, triple in broadcast.by_system(parameters, "sigma_m").items():
        its = system == value
        sigma_m[its] = triple
        mean_motion[its] = np.sqrt(MU_M3PS2 / radius_m[value] ** 3)
    return sigma_m, mean_motion


def free_motion(drawn: F64, sigma_m: F64, angle_rad: F64) -> tuple[F64, F64, F64]:
    """Radial, along- and cross-track errors [m], each of the given 1 sigma at any angle.

    drawn      (..., 5 or more) standard normal numbers
    sigma_m    (n, 3) of the three;  angle_rad (...,) mean motion times age
    """
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    a, b, c, d, e = (drawn[..., j] for j in range(5))
    sigma_radial, sigma_along, sigma_cross = sigma_m.T
    ahead = np.sqrt(sigma_along**2 - 4 * sigma_radial**2)
    radial = sigma_radial * (a * cos + b * sin)
    along = 2 * sigma_radial * (b * cos - a * sin) + ahead * c
    return radial, along, sigma_cross * (d * cos + e * sin)


def orbital_axes(pos_ecef_m: F64, vel_ecef_mps: F64) -> tuple[F64, F64, F64]:
    """Unit vectors (..., 3) up, ahead and along the orbit's normal, of motion relative to inertial space."""
    up = pos_ecef_m / np.linalg.norm(pos_ecef_m, axis=-1, keepdims=True)
    normal = np.cross(pos_ecef_m, vel_ecef_mps + spin(pos_ecef_m))
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return up, np.cross(normal, up), normal


def _reported(params: EphemerisError, seed: int, index: I64, at: ReportInput) -> ReportTerm:
    return ReportTerm(
        off_ecef_m=errors(params, seed, index, at.middles_ns, at.nodes_s, at.pos_ecef_m, at.vel_ecef_mps)
    )


ROW = broadcast.row(
    "ephemeris_error",
    EphemerisError,
    _reported,
    "Montenbruck, Steigenberger & Hauschild, GPS Solutions 19 (2015) 321; Hill's equations",
    shows="SV_X",
)
