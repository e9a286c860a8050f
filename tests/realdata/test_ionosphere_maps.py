"""Real maps: their nodes, RTKLIB's interpolation, and CODE's coefficients of the same day."""

from __future__ import annotations

import gzip
from datetime import datetime

import numpy as np
import pyrtklib
import pytest

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.error_models.ionosphere import Ionosphere, build_field
from gnss_hil.emulator.files import ionex
from gnss_hil.emulator.signal.ionosphere.delay import delay_m
from gnss_hil.emulator.signal.ionosphere.presets import PRESETS
from gnss_hil.emulator.signal.ionosphere.slant import slant_tec_tecu
from tests.support.ionosphere_sky import craft_m, satellites_m, seen
from tests.support.outside import data_file
from tests.support.rtklib_ionosphere import doubles

pytestmark = pytest.mark.realdata

NAMES = {"jplg0010.17i": datetime(2017, 1, 1), "igrg3380.10i": datetime(2010, 12, 4)}
L1_HZ = 1575.42e6


def field_of(name):
    start_ns = gpstime.from_utc(NAMES[name])
    span_ns = (start_ns, start_ns + 86_400_000_000_000)
    path = data_file(f"environment/{name}.gz")
    return build_field(Ionosphere(model="ionex", files=(name,)), [path], span_ns), start_ns


@pytest.mark.parametrize("name", sorted(NAMES))
def test_nodes_are_what_the_producer_wrote(name):
    """Every node of every map, read in another way: all numbers between the lines of a map."""
    field, start_ns = field_of(name)
    lines = gzip.decompress(data_file(f"environment/{name}.gz").read_bytes()).decode().splitlines()
    first, last = (
        [n for n, text in enumerate(lines) if text[60:].startswith(f"{end} OF TEC MAP")]
        for end in ("START", "END")
    )
    assert len(first) == len(last) == 13
    lat, lon = np.deg2rad(np.arange(87.5, -88, -2.5)), np.deg2rad(np.arange(-180, 180, 5.0))
    for k, (a, b) in enumerate(zip(first, last, strict=True)):
        rows = [text for text in lines[a + 2 : b] if "LAT/LON1" not in text]
        written = np.array(" ".join(rows).split(), float).reshape(71, 73)[:, :-1] / 10
        read = field.vertical_tecu(start_ns + k * 7200 * 10**9, 0.0, lat[:, None], lon)
        assert read == pytest.approx(written, abs=1e-6)


@pytest.mark.verifies(
    "emulator/signal/ionosphere/maps.py",
    "emulator/files/ionex.py",
    what="Ionosphere: measured maps, their reader",
    by=(
        "every node of two producers' maps; RTKLIB's interpolation in place and time at 2,000 places, 1e-6 "
        "TECU"
    ),
    status="validated",
)
@pytest.mark.parametrize("name", sorted(NAMES))
def test_between_nodes_as_rtklib(name, tmp_path):
    """RTKLIB's iontec along the vertical, with its correction for the turning Earth."""
    field, start_ns = field_of(name)
    path = tmp_path / name
    path.write_bytes(gzip.decompress(data_file(f"environment/{name}.gz").read_bytes()))
    nav = pyrtklib.nav_t()
    pyrtklib.readtec(str(path), nav, 1)
    rng = np.random.default_rng(3)
    day = NAMES[name]
    midnight = pyrtklib.epoch2time(doubles((day.year, day.month, day.day, 0, 0, 0)))
    delay, variance = doubles((0,)), doubles((0,))
    worst = 0.0
    for _ in range(1000):
        lat, lon = np.deg2rad((rng.uniform(-85, 85), rng.uniform(-180, 180)))
        second = float(rng.integers(0, 86_000))
        found = pyrtklib.iontec(
            pyrtklib.timeadd(midnight, second),
            nav,
            doubles((lat, lon, 0)),
            doubles((0, np.pi / 2)),
            1,
            delay,
            variance,
        )
        assert found
        theirs = delay[0] / 40.30e16 * L1_HZ**2
        ours = field.vertical_tecu(start_ns + int(second) * 10**9, 0.0, np.array(lat), np.array(lon))
        worst = max(worst, abs(float(ours) - theirs))
    assert worst < 1e-6


@pytest.mark.verifies(
    "emulator/files/ionosphere_header.py",
    what="Ionosphere: coefficients in headers",
    by=(
        "real broadcast of 2022-01-01; CODE's coefficients of 2017-01-01 leave less than half of JPL's maps "
        "of that day (rms)"
    ),
    status="validated",
)
def test_coefficients_of_code_are_the_maps_in_short():
    """CODE fitted the eight coefficients to its own maps of the day that JPL's show too. Klobuchar's model is
    said to take away half of the effect: what is left is less than half of the maps' rms content."""
    field, start_ns = field_of("jplg0010.17i")
    path = data_file("environment/CGIM0010.17N")
    model = build_field(Ionosphere(files=("CGIM0010.17N",)), [path], (start_ns, start_ns))
    lat, lon = np.deg2rad(np.arange(-70, 71, 2.5))[:, None], np.deg2rad(np.arange(-180, 180, 5.0))
    weight = np.cos(lat) * np.ones_like(lon)
    left, content, mean = [], [], []
    for hour in range(24):
        measured = field.vertical_tecu(start_ns, hour * 3600.0, lat, lon)
        fitted = model.vertical_tecu(start_ns, hour * 3600.0, lat, lon)
        left.append(np.average((measured - fitted) ** 2, weights=weight))
        content.append(np.average(measured**2, weights=weight))
        mean.append(np.average(measured - fitted, weights=weight))
        assert np.corrcoef(measured.ravel(), fitted.ravel())[0, 1] > 0.75
    assert np.sqrt(np.mean(left)) < 5.0
    assert np.sqrt(np.mean(left) / np.mean(content)) < 0.5
    assert abs(np.mean(mean)) < 2.0


def test_preset_is_the_broadcast_of_that_day():
    path = data_file("navigation/brdc0010.22n.gz")
    field = build_field(Ionosphere(activity="high", files=("brdc0010.22n",)), [path], (0, 0))
    preset = build_field(Ionosphere(activity="low"), [], (0, 0))
    lat, lon = np.linspace(-1.4, 1.4, 41)[:, None], np.linspace(-3, 3, 61)
    place = (1_300_000_000_000_000_000, 0.0, lat, lon)
    assert field.vertical_tecu(*place) == pytest.approx(preset.vertical_tecu(*place), rel=1e-12)
    assert PRESETS["low"].source.endswith("(header of CDDIS' brdc0010.22n)")


def test_two_craft_and_no_steps_in_maps():
    """1 km apart over 8 h: cancels by hundreds; every 50 m: what the grid's edges leave is below 1 mm."""
    field, start_ns = field_of("jplg0010.17i")
    own, apart = [], []
    for t_s in np.arange(0, 30_000, 60.0):
        pos, sv = craft_m(t_s), satellites_m(t_s)
        sv = sv[seen(pos, sv)]
        t_ns = start_ns + round(t_s * 1e9)
        first = delay_m(slant_tec_tecu(field, t_ns, pos, sv), L1_HZ)
        own.append(first)
        apart.append(first - delay_m(slant_tec_tecu(field, t_ns, craft_m(t_s, 1000.0), sv), L1_HZ))
    own, apart = np.concatenate(own), np.concatenate(apart)
    assert np.sqrt(np.mean(own**2) / np.mean(apart**2)) > 500
    for start_s in range(0, 5600, 1400):
        sv = satellites_m(start_s)
        pos = np.array([craft_m(t) for t in start_s + np.arange(0, 20, 50 / 7500)])
        sv = sv[seen(pos[0], sv)]
        content = np.array([slant_tec_tecu(field, start_ns, p, sv) for p in pos])
        assert np.abs(np.diff(delay_m(content, L1_HZ), 2, axis=0)).max() < 1e-3


def test_reader_takes_both_producers():
    for name in NAMES:
        maps = ionex.read(data_file(f"environment/{name}.gz"))
        assert maps.vtec_tecu.shape == (13, 71, 73) and not np.isnan(maps.vtec_tecu).any()
        assert (maps.height_km, maps.base_radius_km) == (450.0, 6371.0)
