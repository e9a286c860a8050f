"""Loops under multipath against correlators that run on a C/A code, and the envelopes of the textbooks."""

import numpy as np
import pytest
from scipy.integrate import quad

from gnss_hil.emulator.signal.correlation import band_limited, triangle
from gnss_hil.emulator.signal.multipath import loop_errors
from gnss_hil.emulator.signal.multipath.loop_errors import CodeLoop

RNG = np.random.default_rng(11)
WAVE_M, CHIP_M = 0.1903, 293.05


def one(amplitude, delay_chips, phase, spacing=0.5, kind="power", direct=1.0, correlate=triangle):
    """Locks with one reflection; phase (p,) is the whole one it arrives with."""
    delay_m = np.atleast_1d(delay_chips) * CHIP_M
    coefficient = amplitude * np.exp(1j * (phase + 2 * np.pi * delay_m / WAVE_M))
    count = len(delay_m)
    return loop_errors.lock(
        CodeLoop(kind, spacing, correlate), np.full(count, direct), delay_m[:, None], coefficient[:, None],
        np.full(count, WAVE_M), np.full(count, CHIP_M),
    )  # fmt: skip


@pytest.mark.parametrize("kind", ["coherent", "power"])
@pytest.mark.parametrize(("amplitude", "spacing"), [(0.5, 1.0), (0.5, 0.1), (0.1, 0.5), (0.3, 0.5)])
def test_code_envelope_of_the_textbook(kind, amplitude, spacing):
    """van Nee 1993, Braasch 1996: rises as a delay / (1 + a), in phase, or -a delay / (1 - a), against it, to
    a d / 2; stays there; reaches zero at a delay of 1 + d / 2."""
    delay = np.r_[np.linspace(0.001, 2, 400), (1 + amplitude) * spacing / 2, (1 - amplitude) * spacing / 2]
    for sign in (1, -1):
        code = one(amplitude, delay, 0.0 if sign > 0 else np.pi, spacing, kind).code_chips
        peak = sign * amplitude * spacing / 2
        largest = (sign * code).max()
        assert largest == pytest.approx(abs(peak), rel=1e-6)
        slope = sign * amplitude / (1 + sign * amplitude)
        rise = delay < (1 + sign * amplitude) * spacing / 2
        np.testing.assert_allclose(code[rise], slope * delay[rise], atol=1e-7)
        ends = 1 - spacing / 2 + sign * amplitude * spacing / 2
        flat = (delay > (1 + sign * amplitude) * spacing / 2) & (delay < ends)
        np.testing.assert_allclose(code[flat], peak, atol=1e-7)
        np.testing.assert_allclose(code[delay > 1 + spacing / 2], 0, atol=1e-7)
        assert np.abs(code[(delay > 1) & (delay < 1 + spacing / 2 - 0.02)]).min() > 0


def test_half_the_amplitude_and_one_chip_spacing_cost_seventy_metres():
    """a d / 2: a quarter of a chip, 73 m of C/A code, at a delay of three quarters."""
    assert one(0.5, [0.75], 0.0, 1.0).code_chips[0] * CHIP_M == pytest.approx(73.3, abs=0.1)


def test_carrier_error_is_at_most_arcsin():
    """asin(a), and a quarter of a cycle, 4.8 cm, as the reflection nears the strength of the direct ray."""
    phase = np.linspace(-np.pi, np.pi, 7201)
    for amplitude in (0.1, 0.5, 0.9):
        lag = one(amplitude, np.full(len(phase), 1e-6), phase).lag_rad
        assert lag.max() == pytest.approx(np.arcsin(amplitude), abs=1e-5)
        assert lag.min() == pytest.approx(-np.arcsin(amplitude), abs=1e-5)
    assert one(0.9999999, [1e-9], np.array([np.pi - 4.5e-4])).lag_rad[0] == pytest.approx(
        -np.pi / 2, abs=1e-3
    )


def test_strength_in_phase_and_against():
    """1 + a and 1 - a at short delays."""
    level = one(0.4, np.full(2, 1e-6), np.array((0, np.pi))).level
    np.testing.assert_allclose(level, (1.4, 0.6), atol=1e-5)


def test_a_reflection_alone_is_followed():
    """Without the direct ray the code error is the whole path difference, and the carrier's as well, less
    what the surface turned, through all cycles: Powe et al. (NAVITEC 2012) saw loops captured on the ISS."""
    delay_m = np.array((3.0, 17.3, 55.0))
    coefficient = -0.4 * np.ones((3, 1))
    found = loop_errors.lock(
        CodeLoop("power", 0.5), np.zeros(3), delay_m[:, None], coefficient.astype(complex),
        np.full(3, WAVE_M), np.full(3, CHIP_M),
    )  # fmt: skip
    np.testing.assert_allclose(found.code_chips * CHIP_M, delay_m, atol=1e-5)
    np.testing.assert_allclose(found.lag_rad * WAVE_M / (2 * np.pi), delay_m - WAVE_M / 2, atol=1e-6)
    np.testing.assert_allclose(found.level, 0.4)


def test_nothing_to_receive_and_nothing_in_the_way():
    none = np.zeros((2, 3))
    found = loop_errors.lock(
        CodeLoop("coherent", 0.5),
        np.array((0.0, 1.0)),
        none,
        none.astype(complex),
        np.full(2, WAVE_M),
        np.full(2, CHIP_M),
    )
    assert found.level.tolist() == [0, 1]
    assert not found.code_chips.any()
    assert not found.lag_rad.any()
    gone = one(1.0, [0.0], np.pi)
    assert gone.level[0] < 1e-12


def gold(prn_taps=(2, 6)):
    """C/A code of PRN 1, +-1. IS-GPS-200, 3.3.2.3; its first ten chips are 1440 octal (table 3-Ia)."""
    g1, g2, out = np.ones(10, int), np.ones(10, int), []
    for _ in range(1023):
        out.append((g1[9] + g2[prn_taps[0] - 1] + g2[prn_taps[1] - 1]) % 2)
        g1 = np.r_[(g1[2] + g1[9]) % 2, g1[:9]]
        g2 = np.r_[(g2[1] + g2[2] + g2[5] + g2[7] + g2[8] + g2[9]) % 2, g2[:9]]
    return np.array(out)


class Correlators:
    """A receiver's correlators on sampled C/A code: rays of given delays and phases, replicas by shifting."""

    RATE = 400
    """Samples a chip."""

    def __init__(self, delay_chips, amplitude):
        code = 1.0 - 2 * gold()
        spectrum = np.fft.rfft(np.repeat(code, self.RATE))
        shifts = np.arange(-4 * self.RATE, 4 * self.RATE + 1)
        self.shift_chips = shifts / self.RATE
        self.correlation = np.fft.irfft(np.abs(spectrum) ** 2)[shifts] / (len(code) * self.RATE)
        self.delay, self.amplitude = delay_chips, amplitude

    def at(self, offset_chips):
        """Between whole samples of shift the correlation of two such codes is straight."""
        return self.amplitude @ np.interp(offset_chips - self.delay, self.shift_chips, self.correlation)


def simulated(loop, spacing, kind, start):
    """Run the code loop: move the replica by the discriminator until it rests."""
    offset, gain = start, 0.25
    for _ in range(400):
        early, prompt, late = (loop.at(offset + s) for s in (-spacing / 2, 0, spacing / 2))
        reference = prompt if kind == "coherent" else early + late
        step = gain * ((early - late) * np.conj(reference)).real / abs(reference) ** 2
        offset -= step
        if abs(step) < 1e-9:
            break
    return offset, prompt


def test_the_code_is_that_of_the_interface_document():
    assert "".join(map(str, gold()[:10])) == f"{0o1440:010b}"


@pytest.mark.verifies(
    "emulator/signal/multipath/loop_errors.py",
    what="Multipath through the discriminator",
    by=(
        "envelopes of van Nee and Braasch (a d / 2, zero at 1 + d / 2, asin a); correlators run on the "
        "sampled C/A code, 3e-3 chips. Loops settle at once, at the strongest place"
    ),
    status="validated",
)
@pytest.mark.parametrize("kind", ["coherent", "power"])
@pytest.mark.parametrize("direct", [1.0, 0.0])
def test_loops_rest_where_correlators_on_a_code_do(kind, direct):
    """Three reflections each. The C/A code's side lobes, which the triangle has not, cost 2e-3 chips."""
    for _ in range(3):
        delay = RNG.uniform(0, 0.25, 3)
        amplitude = RNG.uniform(0.05, 0.25, 3) * np.exp(2j * np.pi * RNG.uniform(size=3))
        on_code = Correlators(np.r_[0, delay], np.r_[direct, amplitude])
        coefficient = amplitude * np.exp(2j * np.pi * delay * CHIP_M / WAVE_M)
        found = loop_errors.lock(
            CodeLoop(kind, 0.5), np.array([direct]), delay[None] * CHIP_M, coefficient[None],
            np.array([WAVE_M]), np.array([CHIP_M]),
        )  # fmt: skip
        offset, prompt = simulated(on_code, 0.5, kind, found.code_chips[0] + 0.05)
        assert found.code_chips[0] == pytest.approx(offset, abs=3e-3)
        assert found.level[0] == pytest.approx(abs(prompt), rel=0.02)
        assert np.cos(found.lag_rad[0] + np.angle(prompt)) == pytest.approx(1, abs=2e-3)


def test_every_rest_is_a_zero_that_brings_back():
    """2,000 channels of six rays, some without the direct one.

    The discriminator is zero there, negative before and positive after.
    """
    count = 2000
    delay = RNG.uniform(0, 0.4, (count, 6))
    coefficient = RNG.uniform(0, 0.9, (count, 6)) * np.exp(2j * np.pi * RNG.uniform(size=(count, 6)))
    direct = (RNG.uniform(size=count) < 0.7).astype(float)
    total = loop_errors.rays(
        direct, delay * CHIP_M, coefficient, np.full(count, WAVE_M), np.full(count, CHIP_M)
    )
    for kind in ("coherent", "power"):
        code, prompt = loop_errors.settle(CodeLoop(kind, 0.5), total)

        def value(offset, kind=kind):
            outputs = [total.at(triangle, offset[:, None] + s)[:, 0] for s in (-0.25, 0, 0.25)]
            return loop_errors.discriminator(kind, *outputs)

        sure = np.abs(prompt) > 0.05
        assert sure.mean() > 0.95
        assert np.abs(value(code))[sure].max() < 1e-6
        assert (value(code - 1e-5) < 1e-9)[sure].all()
        assert (value(code + 1e-5) > -1e-9)[sure].all()


@pytest.mark.verifies(
    "emulator/signal/correlation.py",
    what="Correlation through a front end",
    by="quadrature of the transform, 1e-4",
    status="validated",
)
@pytest.mark.parametrize("bandwidth", [2.0, 8.0, 20.0])
def test_band_limited_correlation(bandwidth):
    """Against quadrature of the transform; wide bands give the triangle."""
    correlate = band_limited(bandwidth)
    power = quad(lambda f: np.sinc(f) ** 2, 0, bandwidth / 2, limit=200)[0]
    for delay in (0.0, 0.1, 0.37, 0.99, 1.4, -0.37):
        exact = quad(
            lambda f, t=delay: np.sinc(f) ** 2 * np.cos(2 * np.pi * f * t), 0, bandwidth / 2, limit=400
        )[0]
        assert correlate(np.array(delay)) == pytest.approx(exact / power, abs=1e-4)
    delays = np.linspace(-1.5, 1.5, 61)
    np.testing.assert_allclose(band_limited(400.0)(delays), triangle(delays), atol=2e-3)


def test_a_narrow_front_end_makes_errors_larger():
    """At narrow spacing and 2 MHz the envelope is far above a d / 2. Van Dierendonck, Fenton & Ford,
    Navigation 39 (1992) 265: narrow correlators need bandwidth."""
    delay = np.linspace(0.02, 1, 50)
    wide = one(0.5, delay, 0.0, 0.1).code_chips.max()
    narrow = one(0.5, delay, 0.0, 0.1, correlate=band_limited(2.0)).code_chips.max()
    assert narrow > 2 * wide


def test_the_strongest_are_kept():
    pair = np.array((2, 0, 2, 2, 0))
    size = np.array((0.1, 0.3, 0.5, 0.2, 0.004)) * np.exp(1j)
    rows = loop_errors.strongest(pair, 3, 2, np.zeros(5), size, 0.01)
    assert rows.tolist() == [[1, -1], [-1, -1], [2, 3]]
