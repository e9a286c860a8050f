"""Content along rays: adaptive quadrature with ERFA's geodetic heights, thin shells, limits, rates."""

from __future__ import annotations

from itertools import pairwise

import erfa
import numpy as np
import pytest
from scipy.integrate import quad

from gnss_hil.emulator.signal.ionosphere.field import Field, of_coefficients
from gnss_hil.emulator.signal.ionosphere.presets import PRESETS
from gnss_hil.emulator.signal.ionosphere.profile import Profile
from gnss_hil.emulator.signal.ionosphere.slant import slant_tec_and_rate, slant_tec_tecu

EQUATOR_M = 6_378_137.0
GPS_M = 26_560e3
T_NS = 1_300_000_000_000_000_000


def even(profile, tecu=10.0):
    return Field(profile, lambda t_ns, later_s, lat, lon: np.full(np.broadcast(lat, lon).shape, tecu))


def rolling(profile):
    """Content that varies smoothly from place to place, by a factor of four."""
    return Field(profile, lambda t_ns, later_s, lat, lon: 25 + 15 * np.cos(lat) * np.cos(lon - 0.4))


def chapman_pm(profile, height_m):
    """The profile's definition, written again; normalised by quadrature below."""
    u = height_m - profile.peak_m
    scale = profile.topside_m if u > 0 else profile.bottomside_m
    return np.exp(0.5 * (1 - u / scale - np.exp(-max(u / scale, -30))))


def plasma_pm(profile, height_m):
    u = height_m - profile.peak_m
    return np.exp(-u / profile.plasmasphere_m) - np.exp(-u / profile.topside_m) if u > 0 else 0.0


def pieces(function, points):
    return sum(
        quad(function, a, b, epsrel=1e-9, epsabs=0, limit=400)[0] for a, b in pairwise(points) if b > a
    )


def density_of(profile):
    heights = [0, 150e3, profile.peak_m, 600e3, 1500e3, 6000e3, 20_200e3]
    layer = pieces(lambda h: chapman_pm(profile, h), heights)
    plasma = pieces(lambda h: plasma_pm(profile, h), heights)
    share = profile.plasmasphere_share
    return lambda h: (1 - share) * chapman_pm(profile, h) / layer + share * plasma_pm(profile, h) / plasma


def brute_force_tecu(field, pos, sv):
    """Adaptive quadrature along the ray; heights are geodetic, by ERFA."""
    density = density_of(field.profile)
    length = np.linalg.norm(sv - pos)
    los = (sv - pos) / length

    def integrand(s):
        at = pos + s * los
        lon, _, height = erfa.gc2gd(1, at)
        lat = np.arctan2(at[2], np.hypot(at[0], at[1]))
        return density(height) * field.vertical_tecu(T_NS, 0.0, lat, lon)

    near = np.clip(-pos @ los, 0, length)
    offsets = np.array([-6e6, -3e6, -1.5e6, -0.6e6, 0, 0.6e6, 1.5e6, 3e6, 6e6, 12e6])
    return pieces(integrand, [0.0, *np.unique(np.clip(near + offsets, 0, length)), length])


def ray(height_m, elevation_deg, azimuth_deg, lat_deg=38.0, lon_deg=20.0):
    """Receiver and satellite on the GPS sphere; elevation above the plane normal to the radius."""
    lat, lon, el, az = np.deg2rad((lat_deg, lon_deg, elevation_deg, azimuth_deg))
    up = np.array((np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)))
    east = np.array((-np.sin(lon), np.cos(lon), 0))
    north = np.cross(up, east)
    los = np.sin(el) * up + np.cos(el) * (np.cos(az) * north + np.sin(az) * east)
    pos = (6_370e3 + height_m) * up
    along = pos @ los
    return pos, pos + (np.sqrt(along**2 - pos @ pos + GPS_M**2) - along) * los


RAYS = [
    (0.0, 90, 0), (0.0, 30, 45), (0.0, 7, 180), (250e3, 60, 300), (250e3, 3, 90), (250e3, -9, 10),
    (410e3, 88, 0), (410e3, 35, 130), (410e3, 5, 220), (410e3, -5, 70), (410e3, -13, 260), (410e3, -18, 350),
    (800e3, 10, 30), (800e3, -20, 150), (1500e3, 20, 0), (1500e3, -28, 310),
]  # fmt: skip


@pytest.mark.verifies(
    "emulator/signal/ionosphere/slant.py",
    what="Ionosphere: content along rays and its rate",
    by=(
        "the integration alone: adaptive quadrature with ERFA's heights, 1e-3, from the ground to GEO; thin "
        "shell 1 / cos z'; rate by the same quadrature, 1e-3, for rays below the peak 1e-2. The profile "
        "itself is modelled, see the presets"
    ),
    status="validated",
)
@pytest.mark.parametrize("activity", ["low", "high"])
@pytest.mark.parametrize(("height_m", "elevation_deg", "azimuth_deg"), RAYS)
@pytest.mark.parametrize("make", [even, rolling])
def test_agrees_with_adaptive_quadrature(make, activity, height_m, elevation_deg, azimuth_deg):
    field = make(PRESETS[activity].profile)
    pos, sv = ray(height_m, elevation_deg, azimuth_deg)
    ours = slant_tec_tecu(field, T_NS, pos, sv[None])[0]
    assert ours == pytest.approx(brute_force_tecu(field, pos, sv), rel=1e-3)


@pytest.mark.parametrize(
    "profile",
    [
        Profile(300e3, 10e3, 20e3, 20_000e3, 0.3),
        Profile(450e3, 100e3, 300e3, 2500e3, 0.1),
        Profile(300e3, 40e3, 65e3, 500e3, 0.5),
    ],
)
@pytest.mark.parametrize(("height_m", "elevation_deg", "azimuth_deg"), RAYS[::3])
def test_agrees_for_odd_profiles_too(profile, height_m, elevation_deg, azimuth_deg):
    pos, sv = ray(height_m, elevation_deg, azimuth_deg)
    field = even(profile)
    ours = slant_tec_tecu(field, T_NS, pos, sv[None])[0]
    assert ours == pytest.approx(brute_force_tecu(field, pos, sv), rel=2e-3)


def test_geo_looks_past_the_earth():
    """From the geostationary orbit to a satellite behind the limb: down, twice through the peak, up again."""
    field = rolling(PRESETS["high"].profile)
    pos = np.array((42_164e3, 0.0, 0.0))
    for height_m in (200e3, 600e3, 2000e3):
        angle = np.arcsin((EQUATOR_M + height_m) / 42_164e3)
        los = np.array((-np.cos(angle), np.sin(angle) * 0.8, np.sin(angle) * 0.6))
        sv = pos + (42_164e3 * np.cos(angle) + np.sqrt(GPS_M**2 - (EQUATOR_M + height_m) ** 2)) * los
        ours = slant_tec_tecu(field, T_NS, pos, sv[None])[0]
        assert ours == pytest.approx(brute_force_tecu(field, pos, sv), rel=2e-3)


@pytest.mark.parametrize("elevation_deg", [90, 60, 30, 10, 3])
def test_thin_shell(elevation_deg):
    """A layer squeezed to 450 km, from below: 1 / cos z' of the single-layer model, around the equator."""
    shell = Profile(450e3, 200.0, 200.0, 2500e3, 0.0)
    el, radius = np.deg2rad(elevation_deg), EQUATOR_M + 100e3
    pos = np.array((radius, 0.0, 0.0))
    sv = pos + 2e7 * np.array((np.sin(el), np.cos(el), 0.0))
    sine = radius * np.cos(el) / (EQUATOR_M + 450e3)
    assert slant_tec_tecu(even(shell), T_NS, pos, sv[None])[0] == pytest.approx(
        10 / np.sqrt(1 - sine**2), rel=1e-3
    )


def test_thin_shell_is_passed_twice_from_above():
    shell = Profile(450e3, 200.0, 200.0, 2500e3, 0.0)
    el, radius = np.deg2rad(-18), EQUATOR_M + 600e3
    pos = np.array((radius, 0.0, 0.0))
    sv = pos + 2e7 * np.array((np.sin(el), np.cos(el), 0.0))
    sine = radius * np.cos(el) / (EQUATOR_M + 450e3)
    assert slant_tec_tecu(even(shell), T_NS, pos, sv[None])[0] == pytest.approx(
        20 / np.sqrt(1 - sine**2), rel=1e-3
    )


def test_above_everything_there_is_nothing():
    field = even(PRESETS["high"].profile, 100.0)
    pos = np.array((42_164e3, 0.0, 0.0))
    assert slant_tec_tecu(field, T_NS, pos, np.array([[60e6, 1e6, 0.0]]))[0] < 1e-2


def test_rays_through_the_earth_are_numbers():
    field = of_coefficients(PRESETS["high"].coefficients, PRESETS["high"].profile)
    pos = np.array((6.79e6, 0.0, 0.0))
    sv = np.array([[-GPS_M, 1.0, 0.0], [-GPS_M, 1e7, 0.0], [0.0, 1.0, GPS_M]])
    assert np.isfinite(slant_tec_tecu(field, T_NS, pos, sv)).all()


def test_one_receiver_or_one_for_each_ray():
    field = of_coefficients(PRESETS["low"].coefficients, PRESETS["low"].profile)
    pos, sv = zip(*(ray(410e3, el, 30) for el in (-10, 20, 70)), strict=True)
    together = slant_tec_tecu(field, T_NS, np.array(pos), np.array(sv))
    assert together == pytest.approx(slant_tec_tecu(field, T_NS, pos[0], np.array(sv)), rel=1e-12)
    assert together == pytest.approx(
        [slant_tec_tecu(field, T_NS, p, s[None])[0] for p, s in zip(pos, sv, strict=True)]
    )


@pytest.mark.parametrize("elevation_deg", [-15, -5, 5, 40, 85])
def test_rate_is_the_derivative(elevation_deg):
    """Five-point derivative of these contents, at orbital speeds, in a turning field: two instants do."""
    profile = PRESETS["high"].profile
    field = Field(profile, lambda t_ns, later, lat, lon: 50 + 30 * np.cos(lat) * np.cos(lon + 7.3e-5 * later))
    pos, sv = ray(410e3, elevation_deg, 60)
    vel, vel_sv = np.array((-3e3, 5e3, 4e3)), np.array((1e3, -2e3, 3e3))

    def content(t_s):
        return slant_tec_tecu(field, T_NS, pos + t_s * vel, (sv + t_s * vel_sv)[None], t_s)[0]

    h = 0.05
    expected = (content(-2 * h) - 8 * content(-h) + 8 * content(h) - content(2 * h)) / (12 * h)
    value, rate = slant_tec_and_rate(field, T_NS, pos[None], vel[None], sv[None], vel_sv[None])
    assert value[0] == pytest.approx(content(0.0), rel=2e-5)
    assert rate[0] == pytest.approx(expected, abs=3e-4)


RATES = [(-15, 1e-2), (-12, 1e-2), (-5, 1e-3), (5, 1e-3), (40, 1e-3), (85, 1e-3)]


@pytest.mark.parametrize(("elevation_deg", "rel"), RATES)
def test_rate_is_that_of_adaptive_quadrature(elevation_deg, rel):
    """Nodes that move with the ray add errors of their own: 1 % of the rate of a ray below the peak."""
    field = rolling(PRESETS["high"].profile)
    pos, sv = ray(410e3, elevation_deg, 60)
    vel, vel_sv = np.array((-3e3, 5e3, 4e3)), np.array((1e3, -2e3, 3e3))
    before, after = (brute_force_tecu(field, pos + t * vel, sv + t * vel_sv) for t in (-0.25, 0.25))
    _, rate = slant_tec_and_rate(field, T_NS, pos[None], vel[None], sv[None], vel_sv[None])
    assert rate[0] == pytest.approx((after - before) / 0.5, rel=rel)
