"""Jamming: overlaps against quadrature, textbook factors and simulated correlators; geometry against ERFA."""

from dataclasses import replace

import erfa
import numpy as np
import pytest
from scipy.integrate import quad

from gnss_hil.emulator.signal import antenna_patterns, jamming, link_budget
from gnss_hil.emulator.signal.jamming import Jammers

pytestmark = pytest.mark.verifies(
    "emulator/signal/jamming.py",
    what="Jamming: overlap of spectra, effective C/N0, geometry",
    by="textbook factors 1, 1.5, 2.22; quadrature; simulated correlators; ERFA's places, ITU-R P.525",
    status="validated",
)

CHIP_HZ = 1.023e6
ISOTROPIC = antenna_patterns.receive((link_budget.shipped("isotropic"),), 0.0)


def overlap(kind, offset_hz=0.0, bandwidth_hz=2 * CHIP_HZ):
    return jamming.overlap_perhz(kind, np.array([offset_hz]), bandwidth_hz, np.array([CHIP_HZ]))[0]


def jammers(place=(), eirp=(), direction=(), received=(), kind="noise", bandwidth_hz=2.046e6):
    count = len(eirp) + len(received)
    places, directions = (np.array(vectors, float).reshape(-1, 3) for vectors in (place, direction))
    powers = np.array(eirp, float), np.array(received, float)
    spectrum = (kind,) * count, np.full(count, 1575.42e6), np.full(count, bandwidth_hz)
    return Jammers(places, powers[0], directions, powers[1], *spectrum)


@pytest.mark.parametrize("kind, q", (("tone", 1.0), ("matched", 1.5), ("noise", 2.22)))
def test_factors_of_the_textbook(kind, q):
    """Kaplan & Hegarty, 3rd ed., 9.2: Q = 1 tone, 1.5 matched spectrum, 2.22 noise from null to null."""
    assert 1 / (overlap(kind) * CHIP_HZ) == pytest.approx(q, abs=0.006)


@pytest.mark.parametrize("offset", (0.0, 0.3, 1.0, 2.7, 26.0))
@pytest.mark.parametrize("width", (0.01, 0.8, 2.0, 20.0))
def test_noise_overlap_by_quadrature(offset, width):
    expected, _ = quad(lambda x: np.sinc(x) ** 2, offset - width / 2, offset + width / 2, limit=500)
    found = overlap("noise", offset * CHIP_HZ, width * CHIP_HZ)
    assert found * CHIP_HZ == pytest.approx(expected / width, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("offset", (0.0, 1e-3, 0.4, 1.0, 3.3))
def test_matched_overlap_by_quadrature(offset):
    expected, _ = quad(lambda x: np.sinc(x) ** 2 * np.sinc(x - offset) ** 2, -60, 60, limit=2000)
    assert overlap("matched", offset * CHIP_HZ) * CHIP_HZ == pytest.approx(expected, rel=1e-4, abs=2e-6)


@pytest.mark.parametrize("offset_hz", [0.0, 1e-7, 1e-3, 1.0, 1.6e3, 1.7e3])
def test_matched_overlap_close_to_the_carrier(offset_hz):
    """2/3 on it (Kaplan & Hegarty: Q = 1.5), and all but that a thousandth of a chipping rate off."""
    assert overlap("matched", offset_hz) * CHIP_HZ == pytest.approx(2 / 3, abs=4e-6)


def test_overlap_is_what_simulated_correlators_keep():
    """Noise of one chipping rate's width, half a rate off, and random codes: variance of the correlations."""
    rng = np.random.default_rng(5)
    chips, per_chip, runs = 256, 8, 3000
    samples = chips * per_chip
    frequency = np.fft.fftfreq(samples, 1 / (per_chip * CHIP_HZ))
    band = np.abs(frequency - 0.5 * CHIP_HZ) < 0.5 * CHIP_HZ
    power = np.empty(runs)
    for i in range(runs):
        white = rng.normal(size=samples) + 1j * rng.normal(size=samples)
        jam = np.fft.ifft(np.where(band, white, 0))
        jam /= np.sqrt(2 * band.sum()) / samples  # unit mean power
        code = np.repeat(rng.choice((-1.0, 1.0), chips), per_chip)
        power[i] = np.abs(np.mean(jam * code)) ** 2
    kept = power.mean() * chips / CHIP_HZ  # density of equivalent noise = power times correlation time
    assert kept == pytest.approx(overlap("noise", 0.5 * CHIP_HZ, CHIP_HZ), rel=0.07)


def test_glonass_is_far_from_a_jammer_on_gps():
    both = jamming.overlaps_perhz(
        jammers(received=(-100,), direction=((0, 0, 1),)), np.array([0, 1]), np.zeros(2, int)
    )
    assert both[0, 1] < 1e-3 * both[0, 0]


def test_a_tone_hits_the_frequency_number_that_it_stands_on():
    """GLONASS ICD 5.1, 3.3.1.1: carriers 562.5 kHz apart; a tone on a carrier of 511 kHz chips: Q = 1."""
    tone = jamming.Jammers(
        np.zeros((0, 3)), np.zeros(0), np.array([[0.0, 0.0, 1.0]]), np.array([-100.0]), ("tone",),
        np.array([1602e6 + 5 * 562.5e3]), np.array([0.0]),
    )  # fmt: skip
    hit, missed = jamming.overlaps_perhz(tone, np.array([1, 1]), np.array([5, -5]))[0]
    assert hit == pytest.approx(1 / 511e3)
    assert missed < 0.01 * hit


@pytest.mark.parametrize("kind, q", (("tone", 1.0), ("matched", 1.5)))
def test_effective_cn0_is_the_textbooks_equation(kind, q):
    """Kaplan & Hegarty, 3rd ed., 9.2: 1 / (1 / (C/N0) + (J/S) / (Q Rc)); 44 dBHz and a J/S of 40 dB."""
    carrier_w, cn0, js = 1e-16, 10**4.4, 1e4
    jam = jammers(received=(10 * np.log10(js * carrier_w),), direction=((0, 0, 1),), kind=kind)
    arrival = jamming.arrivals(jam, np.array([7e6, 0, 0]), np.eye(3))
    overlaps = jamming.overlaps_perhz(jam, np.array([0]), np.array([0]))
    density = jamming.density_wphz(arrival, ISOTROPIC, np.array([[0.0, 0, 1]]), overlaps)
    found = carrier_w / (carrier_w / cn0 + density[0, 0])
    assert found == pytest.approx(1 / (1 / cn0 + js / (q * CHIP_HZ)), rel=1e-9)


def test_the_documents_jammer_is_41_decibel_above_the_noise():
    """-100 dBW over 2 MHz at an isotropic antenna; -204 dBW/Hz of noise. Loss in the correlator apart."""
    jam = jammers(received=(-100,), direction=((0, 0, 1),), bandwidth_hz=2e6)
    arrival = jamming.arrivals(jam, np.array([7e6, 0, 0]), np.eye(3))
    overlaps = jamming.overlaps_perhz(jam, np.array([0]), np.array([0]))
    density = jamming.density_wphz(arrival, ISOTROPIC, np.array([[0.0, 0, 1]]), overlaps)
    in_correlator_db = 10 * np.log10(0.90)  # share of the signal's power between its nulls
    assert 10 * np.log10(density[0, 0]) + 204.0 == pytest.approx(41.0 + in_correlator_db, abs=0.1)


def test_the_receive_pattern_stands_between():
    """A null of 80 dB towards the Earth takes 80 dB off a jammer there, for every satellite alike."""
    cone = antenna_patterns.receive(
        (link_budget.shipped("cone-20deg"), link_budget.shipped("isotropic")), 0.0
    )
    craft = np.array([42_164_000.0, 0, 0])
    jam = jammers(place=(jamming.place_ecef_m(0.5, 0.2, 0.0),), eirp=(50.0,))
    overlaps = jamming.overlaps_perhz(jam, np.array([0, 0]), np.zeros(2, int))
    down = np.array([[-1.0, 0, 0], [-1.0, 0, 0]])
    density = jamming.density_wphz(jamming.arrivals(jam, craft, np.eye(3)), cone, down, overlaps)
    assert 10 * np.log10(density[0] / density[1]) == pytest.approx([-68, -68])  # lobes of 12 dBi less 80 dB


def test_power_falls_with_distance_by_friis():
    jam = jammers(place=((6_378_137.0, 0, 0),), eirp=(30.0,))
    found = jamming.arrivals(jam, np.array([6_778_137.0, 0, 0]), np.eye(3)).power_w[0]
    space_db = 32.44778 + 20 * np.log10(400.0) + 20 * np.log10(1575.42)  # ITU-R P.525-4, eq. 3: km, MHz
    assert 10 * np.log10(found) == pytest.approx(30.0 - space_db, abs=1e-3)


@pytest.mark.parametrize("beyond_deg, hidden", ((-0.01, False), (0.01, True), (90.0, True)))
def test_the_earth_hides_what_is_below_the_horizon(beyond_deg, hidden):
    radius_m = 6_778_137.0
    horizon = np.arccos(6_378_137.0 / radius_m)
    jam = jammers(place=(jamming.place_ecef_m(0.0, horizon + np.radians(beyond_deg), 0.0),), eirp=(30.0,))
    assert (jamming.arrivals(jam, np.array([radius_m, 0, 0]), np.eye(3)).power_w[0] == 0) == hidden


@pytest.mark.parametrize("place", ((55.75, 37.62, 150.0), (-90.0, 0.0, 0.0), (0.0, -75.2, 35_786_000.0)))
def test_places_are_erfas(place):
    latitude, longitude = np.radians(place[:2])
    expected = erfa.gd2gc(1, longitude, latitude, place[2])
    assert jamming.place_ecef_m(latitude, longitude, place[2]) == pytest.approx(expected, abs=1e-3)


def test_a_jammer_fixed_to_the_craft_turns_with_it():
    quarter = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])  # body x is ecef y
    arrival = jamming.arrivals(
        jammers(direction=((1, 0, 0),), received=(-90,)), np.array([7e6, 0, 0]), quarter
    )
    assert arrival.los_ecef == pytest.approx(np.array([[0, 1, 0]]))


def test_no_jammer_no_density():
    jam = jammers()
    overlaps = jamming.overlaps_perhz(jam, np.array([0, 1]), np.zeros(2, int))
    arrival = jamming.arrivals(jam, np.array([7e6, 0, 0]), np.eye(3))
    assert not jamming.density_wphz(arrival, ISOTROPIC, np.array([[0.0, 0, 1]]), overlaps).any()


def test_a_jammer_in_time_is_on_from_its_first_instant_until_before_its_last():
    jam = replace(jammers(direction=((1, 0, 0),), received=(-90,)), on_ns=np.array([[10, 20]]))
    powers = [jamming.arrivals(jam, np.array([7e6, 0, 0]), np.eye(3), t).power_w[0] for t in (9, 10, 19, 20)]
    assert powers == pytest.approx([0, 1e-9, 1e-9, 0])
