"""The flight software's own ionosphere: vertical delay by RTKLIB, content along rays by quadrature, errors by
the emulator's ionosphere, which is another profile."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pyrtklib
import pytest
from scipy.integrate import quad

from gnss_hil.emulator.signal.ionosphere import field
from gnss_hil.emulator.signal.ionosphere.delay import delay_m as emulated_delay_m
from gnss_hil.emulator.signal.ionosphere.presets import PRESETS
from gnss_hil.emulator.signal.ionosphere.slant import slant_tec_and_rate
from gnss_hil.flightsw.measurement import ionosphere as flight
from gnss_hil.flightsw.measurement.range_model import rays
from gnss_hil.flightsw.records.epoch import Coefficients
from tests.support.rtklib_ionosphere import doubles

pytestmark = pytest.mark.verifies(
    "flightsw/measurement/ionosphere.py",
    what="Ionospheric delay from a craft at any height, and how far it is known",
    by=(
        "RTKLIB's vertical delay, 1 mm; SciPy's quadrature along rays; the emulator's ionosphere of another "
        "profile; GRACE-B on one frequency against its published orbit: mean NEES 3.2"
    ),
    status="validated",
)

EARTH = 6_378_137.0
COEFFICIENTS = {
    name: Coefficients(np.array(p.coefficients.alpha), np.array(p.coefficients.beta))
    for name, p in PRESETS.items()
}


def directions(place_m, count=40, lowest_deg=-10.0):
    """(3, count) unit vectors above an elevation, seen from a place."""
    rng = np.random.default_rng(8)
    up = place_m / np.linalg.norm(place_m)
    found = []
    while len(found) < count:
        u = rng.normal(size=3)
        u /= np.linalg.norm(u)
        if np.degrees(np.arcsin(u @ up)) > lowest_deg:
            found.append(u)
    return np.array(found).T


@pytest.mark.parametrize("name", sorted(COEFFICIENTS))
def test_vertical_delay_is_rtklibs(name):
    """At the zenith, where its mapping is 1.00043 (IS-GPS-200: 1 + 16 (0.53 - 0.5)^3) and its point 8 km
    to the north: of the step in which the letter's cosine ends, either may have met the other side."""
    steps = 0
    rng = np.random.default_rng(2)
    known = COEFFICIENTS[name]
    ion = doubles((*known.alpha, *known.beta))
    for _ in range(300):
        lat, lon, second = rng.uniform(-70, 70), rng.uniform(-180, 180), float(rng.integers(0, 86_400))
        lat_rad, lon_rad = np.deg2rad((lat, lon))
        theirs = pyrtklib.ionmodel(
            pyrtklib.gpst2time(1042, second), ion, doubles((lat_rad, lon_rad, 0.0)), doubles((0.0, np.pi / 2))
        )
        place = EARTH * np.array(
            [[np.cos(lat_rad) * np.cos(lon_rad)], [np.cos(lat_rad) * np.sin(lon_rad)], [np.sin(lat_rad)]]
        )
        ours = flight.vertical_delay_m(flight.Ionosphere(known, second), place)[0]
        if abs(ours * 1.000432 - theirs) > 0.03:
            assert min(ours, theirs) == pytest.approx(1.5, abs=0.02), "the step is one from the night"
            steps += 1
    assert steps < 6


@pytest.mark.parametrize("height_m", [0.0, 415e3, 1_000e3])
def test_content_along_a_ray_is_the_integral_of_the_layer(height_m):
    """At the pole's side of the equator, so that heights are those of a sphere."""
    place = np.array([EARTH + height_m, 0.0, 0.0])
    los = directions(place)
    los[2] = 0.0  # in the equator's plane
    los /= np.linalg.norm(los, axis=0)
    share, _ = flight._content(np.repeat(place[:, None], los.shape[1], 1), los, np.full(los.shape[1], 5e7))

    def density(s, u):
        above = np.linalg.norm(place + s * u) - EARTH - flight.PEAK_M
        z = max(above / flight.SCALE_M, -6.0)
        layer = np.exp(0.5 * (1 - z - np.exp(-z))) / (np.sqrt(2 * np.pi * np.e) * flight.SCALE_M)
        sphere = np.exp(-above / flight.PLASMASPHERE_M) / flight.PLASMASPHERE_M * (above > 0)
        return 0.9 * layer + 0.1 * sphere

    for k, u in enumerate(los.T):
        far = -place @ u + np.sqrt((EARTH + 2e7) ** 2 - place @ place + (place @ u) ** 2)
        ends = np.concatenate((np.arange(0.0, 4e6, 2e4), np.geomspace(4e6, far, 60)))
        whole = sum(quad(density, a, b, args=(u,))[0] for a, b in pairwise(ends))
        assert share[k] == pytest.approx(whole, rel=0.06, abs=0.003)


def test_from_the_ground_the_zenith_has_all_of_it_and_from_above_nothing():
    up = np.array([[1.0], [0.0], [0.0]])
    for height_m, expected in ((0.0, 1.0), (20_000e3, 0.0)):
        share, _ = flight._content((EARTH + height_m) * up, up, np.array([3e7]))
        assert share[0] == pytest.approx(expected, abs=0.01)


def test_a_ray_that_grazes_the_earth_from_far_above_crosses_it_twice():
    """From a geostationary orbit past the Earth, 300 km over its edge, to a satellite behind it."""
    antenna = np.array([[42_164e3], [0.0], [0.0]])
    off = np.arcsin((EARTH + 300e3) / 42_164e3)
    los = np.array([[-np.cos(off)], [np.sin(off)], [0.0]])
    share, _ = flight._content(antenna, los, np.array([6.7e7]))
    assert 5 < share[0] < 25
    assert flight._content(antenna, -los, np.array([2e7]))[0][0] == 0.0


@pytest.mark.parametrize("name", sorted(PRESETS))
@pytest.mark.parametrize("height_m", [415e3, 800e3])
def test_what_is_left_of_the_emulators_ionosphere_is_as_large_as_it_says(name, height_m):
    """Another profile with another thickness and a plasmasphere: one factor for all rays of a place, and what
    each ray has besides, within what is promised of both."""
    rng = np.random.default_rng(3)
    electrons = field.of_coefficients(PRESETS[name].coefficients, PRESETS[name].profile)
    factors, own = [], []
    for _ in range(40):
        u = rng.normal(size=3)
        place = (EARTH + height_m) * u / np.linalg.norm(u)
        los = directions(place, 20, 5.0)
        second = float(rng.integers(0, 86_400))
        t_ns = int(1042 * 604_800e9 + second * 1e9)
        there = place[:, None] + 2e7 * los
        content, _ = slant_tec_and_rate(
            electrons, t_ns, np.repeat(place[None], 20, 0), np.zeros((20, 3)), there.T, np.zeros((20, 3)),
            np.zeros(20),
        )  # fmt: skip
        truth = emulated_delay_m(content, 1575.42e6)
        found = flight.delay(
            flight.Ionosphere(COEFFICIENTS[name], second), np.repeat(place[:, None], 20, 1), los,
            np.full(20, 2e7),
        )  # fmt: skip
        off = truth - found.modelled_m
        factor = (off @ found.common_m) / (found.common_m @ found.common_m)
        factors.append(factor)
        own.extend((off - factor * found.common_m) / np.sqrt(found.own_m2))
    assert np.sqrt(np.mean(np.square(factors))) < 1.5
    assert np.sqrt(np.mean(np.square(own))) < 1.5


def test_the_rate_is_the_change_of_the_delay():
    place = np.array([EARTH + 415e3, 0.0, 0.0])
    los = directions(place, 12, 10.0)
    antenna_m = np.repeat(place[:, None], 12, 1)
    velocity = np.repeat(np.array([[0.0], [4_700.0], [6_000.0]]), 12, 1)
    sky = flight.Ionosphere(COEFFICIENTS["high"], 50_000.0)
    seen = rays(antenna_m + 2.1e7 * los, antenna_m)
    found = flight.delay_rate(sky, seen, velocity, np.zeros((3, 12)))
    later = rays(antenna_m + 2.1e7 * los, antenna_m + 0.01 * velocity)
    slope = (
        flight.delay(sky, later.antenna_m, later.los, later.distance_m).modelled_m
        - flight.delay(sky, seen.antenna_m, seen.los, seen.distance_m).modelled_m
    ) / 0.01
    assert found.modelled_m == pytest.approx(slope, abs=2e-3)
    assert np.abs(slope).max() > 0.02


def grazing(height_m, lowest_m, sinks_mps=0.0):
    """A ray from a satellite of GPS past the Earth to a craft over the equator, in the equator's plane; the
    satellite moves so that the ray's lowest point sinks."""
    radius_m = EARTH + height_m
    off = np.arcsin((EARTH + lowest_m) / radius_m)
    antenna_m = np.array([[radius_m], [0.0], [0.0]])
    los = np.array([[-np.cos(off)], [np.sin(off)], [0.0]])
    back_m = np.sqrt(radius_m**2 - (EARTH + lowest_m) ** 2)
    distance_m = back_m + np.sqrt(26_560e3**2 - (EARTH + lowest_m) ** 2)
    down = np.array([[-np.sin(off)], [-np.cos(off)], [0.0]])
    return rays(antenna_m + distance_m * los, antenna_m), down * sinks_mps * distance_m / back_m


def rate_of(along, sv_mps, antenna_mps=0.0):
    # `rays` turns satellites with the Earth; here they are where they are.
    still = replace(along, pos_sv_m=along.antenna_m + along.distance_m * along.los)
    sky = flight.Ionosphere(COEFFICIENTS["high"], 40_000.0)
    velocity = np.zeros((3, 1)) + antenna_mps
    return flight.delay_rate(sky, still, velocity, sv_mps), flight.delay(
        sky, still.antenna_m, still.los, still.distance_m
    )


@pytest.mark.parametrize("sinks_mps", [2_000.0, -4_000.0])
@pytest.mark.parametrize("height_m", [3_000e3, 7_000e3])
def test_a_rays_rate_is_off_by_how_fast_it_scans_the_layer(height_m, sinks_mps):
    along, sv_mps = grazing(height_m, 250e3, sinks_mps)
    rate, delay = rate_of(along, sv_mps)
    scanned = delay.modelled_m * sinks_mps / flight.SCALE_M
    assert rate.own_m2 == pytest.approx(flight.OWN**2 * (rate.modelled_m**2 + scanned**2), rel=0.05)
    assert abs(scanned[0]) > 2 * abs(rate.modelled_m[0])


def sunk_through_the_layer():
    """Rates and delays of rays from 7,000 km that sink by 3 km/s, every 5 km."""
    return [rate_of(*grazing(7_000e3, low, 3_000.0)) for low in np.arange(150e3, 400e3, 5e3)]


def test_rates_of_rays_that_sink_through_the_layer_have_no_steps():
    """Though the layer is of shells of 30 km: by their roots near rates would have steps of 0.7 m/s."""
    rates = np.array([rate.modelled_m[0] for rate, _ in sunk_through_the_layer()])
    assert np.ptp(rates) > 1.5 and np.abs(np.diff(rates)).max() < 0.25


def test_where_the_delay_is_largest_its_rate_is_none_and_as_uncertain():
    found = sunk_through_the_layer()
    rates = np.array([rate.modelled_m[0] for rate, _ in found])
    own = np.sqrt([rate.own_m2[0] for rate, _ in found])
    best = int(np.argmax([delay.modelled_m[0] for _, delay in found]))
    assert 0 < best < len(found) - 1 and abs(rates[best]) < 0.3 * np.abs(rates).max()
    assert own[best] > 0.8 * own.max()


def test_a_ray_that_begins_upwards_is_off_as_its_rate_is():
    """From a circular orbit it scans nothing; from a craft that sinks, the layer over the craft."""
    place = np.array([[EARTH + 415e3], [0.0], [0.0]])
    up = np.array([[0.6], [0.8], [0.0]])
    along = rays(place + 2.1e7 * up, place)
    level, delay = rate_of(along, np.zeros((3, 1)), np.array([[0.0], [7_000.0], [0.0]]))
    assert level.own_m2 == pytest.approx((flight.OWN * level.modelled_m) ** 2, rel=1e-3)
    sinking, _ = rate_of(along, np.zeros((3, 1)), np.array([[-200.0], [0.0], [0.0]]))
    scanned = delay.modelled_m * 200.0 / flight.SCALE_M
    assert sinking.own_m2 == pytest.approx(flight.OWN**2 * (sinking.modelled_m**2 + scanned**2), rel=1e-2)


@pytest.mark.parametrize("name", sorted(PRESETS))
@pytest.mark.parametrize("height_m", [3_000e3, 7_000e3])
def test_what_is_left_of_the_emulators_rates_is_as_large_as_it_says(name, height_m):
    """Rays past the Earth from far above the layer, through another profile: one factor for all of a place,
    and what each has besides."""
    rng = np.random.default_rng(4)
    electrons = field.of_coefficients(PRESETS[name].coefficients, PRESETS[name].profile)
    own = []
    for _ in range(60):
        place, velocity = circling(EARTH + height_m, 1, rng)
        sv_m, sv_mps = circling(26_560e3, 400, rng)
        away_m = sv_m - place
        distance_m = np.linalg.norm(away_m, axis=0)
        los = away_m / distance_m
        begin = np.add.reduce(place * los)
        lowest_m = np.sqrt(np.add.reduce(place * place) - begin**2) - EARTH
        past = np.flatnonzero((begin < 0) & (lowest_m > 100e3) & (lowest_m < 800e3))[:12]
        n = len(past)
        place, velocity = np.repeat(place, n, 1), np.repeat(velocity, n, 1)
        second = float(rng.integers(0, 86_400))
        _, content_rate = slant_tec_and_rate(
            electrons, int(1042 * 604_800e9 + second * 1e9), place.T, velocity.T, sv_m[:, past].T,
            sv_mps[:, past].T, np.zeros(n),
        )  # fmt: skip
        seen = replace(rays(sv_m[:, past], place), pos_sv_m=sv_m[:, past])
        found = flight.delay_rate(
            flight.Ionosphere(COEFFICIENTS[name], second), seen, velocity, sv_mps[:, past]
        )
        off = emulated_delay_m(content_rate, 1575.42e6) - found.modelled_m
        factor = (off @ found.common_m) / (found.common_m @ found.common_m)
        own.extend((off - factor * found.common_m) / np.sqrt(found.own_m2))
    assert 0.4 < np.sqrt(np.mean(np.square(own))) < 1.2


def circling(radius_m, count, rng):
    """Places and velocities (3, count) on circular orbits of any plane."""
    u, w = rng.normal(size=(2, 3, count))
    u /= np.linalg.norm(u, axis=0)
    along = np.cross(u, w, axis=0)
    return radius_m * u, np.sqrt(3.986e14 / radius_m) * along / np.linalg.norm(along, axis=0)
