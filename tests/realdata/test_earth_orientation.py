"""The Earth's orientation as measured: what is known of it since 1980 in one file."""

from __future__ import annotations

import gzip
from datetime import datetime

import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime, vehicle
from gnss_hil.emulator.assemble import build_world
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.config.named_files import anchor
from gnss_hil.emulator.earth import frames
from gnss_hil.emulator.files import finals
from gnss_hil.emulator.numerics.rotations import dcm_of_quaternion
from tests.support.outside import data_file, peer

pytestmark = [
    pytest.mark.realdata,
    pytest.mark.verifies(
        what="Measured orientation of the Earth, from file to flown orbit and attitude",
    ),
]

FILE = "environment/finals2000A.all.gz"


@pytest.fixture(scope="module")
def measured():
    return finals.read(data_file(FILE))


def test_the_whole_file_is_read_and_knows_vallados_example(measured):
    """Vallado, Fundamentals of Astrodynamics, example 3-15, which takes the values of 2004-04-06 00:00."""
    assert len(measured.t_ns) > 16_000
    ut1_gps_s, pole_rad = measured.at(np.array(gpstime.from_utc(datetime(2004, 4, 6))))
    assert ut1_gps_s + 13 == pytest.approx(-0.4399619, abs=2e-5)
    # The pole has been computed anew since his edition.
    assert pole_rad * 648_000 / np.pi == pytest.approx([-0.140682, 0.333309], abs=5e-4)
    # UT1 - GPS has no leap seconds: it drifts by some milliseconds a day, never by a second.
    assert np.abs(np.diff(measured.ut1_gps_s)).max() < 5e-3


def test_brahe_reads_the_same_earth_in_it(measured, tmp_path):
    """brahe takes the file's corrections of the pole of date too, dX and dY: some 0.3 mas, 1 cm in low
    orbit. TEME has none of them. A leap second it spreads over the day before, which is left out."""
    brahe = peer("brahe")
    plain = tmp_path / "finals2000A.all"
    plain.write_bytes(gzip.decompress(data_file(FILE).read_bytes()))
    provider = brahe.FileEOPProvider.from_file(str(plain), True, "Error")
    brahe.set_global_eop_provider_from_file_provider(provider)
    pos_m = 6.8e6 * np.array((1, 2, 2)) / 3
    off_m = {"GCRF": [], "EME2000": [], "TEME": []}
    for days in range(0, 9000, 73):
        moment = gpstime.from_utc(datetime(2001, 1, 1, 3, 4, 5)) + days * 86_400_000_000_000
        if gpstime.leap_seconds(moment) != gpstime.leap_seconds(moment + 86_400_000_000_000):
            continue
        epoch = brahe.Epoch.from_gps_nanoseconds(moment)
        gcrf_m = brahe.position_eme2000_to_gcrf(pos_m)
        for name, ours, theirs in (
            ("GCRF", frames.ecef_from_gcrs, brahe.position_gcrf_to_itrf(epoch, pos_m)),
            ("EME2000", frames.ecef_from_eme2000, brahe.position_gcrf_to_itrf(epoch, gcrf_m)),
            ("TEME", frames.ecef_from_teme, brahe.position_teme_to_itrf(epoch, pos_m)),
        ):
            off_m[name].append(np.linalg.norm(ours(moment, measured) @ pos_m - theirs))
    print(
        {name: f"{1e3 * np.median(off):.2f} mm, {1e3 * max(off):.2f} at most" for name, off in off_m.items()}
    )
    assert max(*off_m["GCRF"], *off_m["EME2000"]) < 0.025
    assert max(off_m["TEME"]) < 1e-3


@pytest.fixture(scope="module")
def station():
    """Worlds of the shipped scenario, as it is and with the line that names a file of orientation."""
    folder = data_file(FILE).parents[1]
    data_file("iss_2021-06-10/iss_sc_v01.ephemeris.spk.20210610.csv.gz")
    path = scenario.shipped()["iss-flown"]
    worlds = []
    for named in (False, True):
        document = scenario.read(path)
        if named:
            (line,) = (line for line in path.read_text().splitlines() if line.startswith("# orientation = "))
            document["time"]["orientation"] = line.split('"')[1]
        anchor(document, folder)
        given = scenario.parse(document, str(path))
        worlds.append(build_world(given, [vehicle.load(vehicle.find("iss-asn-m"))], 1))
    return worlds


def test_the_station_of_2021_is_turned_with_its_attitude(station):
    """UT1 - UTC was -0.18 s: places move by up to 90 m, and the body looks from there as it did."""
    off_m = []
    for t_s in range(0, 6600, 300):
        t_ns = station[0].start_ns + t_s * gpstime.NS_PER_S
        plain, turned = (world.craft[0].environment.orbit.at(t_ns) for world in station)
        seen = [
            dcm_of_quaternion(world.craft[0].environment.attitude.at(t_ns, None)[0]) @ state.pos_ecef_m
            for world, state in zip(station, (plain, turned), strict=True)
        ]
        off_m.append(np.linalg.norm(turned.pos_ecef_m - plain.pos_ecef_m))
        assert seen[0] == pytest.approx(seen[1], abs=1e-3)
    print(f"ISS 2021: {min(off_m):.1f} to {max(off_m):.1f} m from where UT1 is UTC")
    assert 40 < min(off_m) < 70 and 80 < max(off_m) < 105
