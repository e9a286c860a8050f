"""Published almanacs: of one month against the next, of GLONASS against its slots, and in a run."""

from __future__ import annotations

import json
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.emulator.constellation.almanac import orbits
from gnss_hil.emulator.constellation.nominal import nominal_glonass
from gnss_hil.emulator.files import almanacs
from gnss_hil.tools.command_line import main
from tests.support import buslog
from tests.support.outside import data_file

pytestmark = pytest.mark.realdata

IN_2016 = gpstime.from_calendar(datetime(2016, 4, 2))
DBC = Path(__file__).parents[2] / "dbc" / "contract" / "gnss.dbc"


def yuma_and_sem():
    names = ("almanacs/20160331.alm", "almanacs/current.al3")
    return [almanacs.read(data_file(name), IN_2016) for name in names]


@pytest.mark.verifies(
    "emulator/files/almanacs.py",
    what="Almanac files (YUMA, SEM, AGL)",
    by=(
        "YUMA and SEM of 2016, two files in two units, meet halfway at 18 km (median); the two roll-overs of "
        "GPS weeks; any text is read or refused in words. AGL by a maker's description and the nominal slots"
    ),
    status="validated",
)
def test_almanacs_of_two_months_meet():
    """Halfway between, each 16 days from its own reference: two files, two units, one sky."""
    yuma, sem = yuma_and_sem()
    assert yuma.number.tolist() == sem.number.tolist() == [n for n in range(1, 33) if n != 4]
    index = satellites.index(satellites.GPS, yuma.number)
    middle_ns = int(yuma.reference_ns[0] + sem.reference_ns[0]) // 2
    rows = np.arange(len(index))
    one, other = (
        orbits.hold(index, [part], int(part.reference_ns[0])).at(rows, middle_ns) for part in (yuma, sem)
    )
    apart_km = np.linalg.norm(one.pos_ecef_m - other.pos_ecef_m, axis=1) / 1e3
    # G32, not yet in service in March, is on its way to its slot: 34 000 km from there.
    stayed = sem.healthy & yuma.healthy
    print(f"YUMA - SEM at 16 days: median {np.median(apart_km[stayed]):.1f} km, {np.sort(apart_km)[-5:]}")
    assert np.median(apart_km[stayed]) < 25
    # Three of 29 are hundreds of kilometres from where they were heading: moved within their slots, it seems.
    assert np.count_nonzero(apart_km[stayed] > 60) <= 3
    assert apart_km[stayed].max() < 1000


def test_glonass_flies_in_its_slots():
    bulletin = almanacs.read(data_file("almanacs/MCCJ_180913.agl"), IN_2016)
    assert bulletin.number.tolist() == list(range(1, 25))
    assert bulletin.healthy.all()
    t_ns = int(bulletin.reference_ns.max()) + 7 * 86400 * 10**9
    told = orbits.hold(
        satellites.index(satellites.GLONASS, bulletin.number), [bulletin], int(bulletin.reference_ns[0])
    ).at(np.arange(24), t_ns)
    slots = nominal_glonass(t_ns).sample(np.array([t_ns]), np.zeros(1))[0][0, 0]
    cosine = np.einsum("ij,ij->i", told.pos_ecef_m, slots)
    cosine /= np.linalg.norm(told.pos_ecef_m, axis=1) * np.linalg.norm(slots, axis=1)
    off_deg = np.rad2deg(np.arccos(cosine))
    print(f"GLONASS almanac from nominal slots: median {np.median(off_deg):.1f}, max {off_deg.max():.1f} deg")
    assert np.median(off_deg) < 3
    assert off_deg.max() < 11


def navigation(almanac, folder):
    """An almanac's satellites as a RINEX 2 navigation file: what flies in the run below."""

    def numbers(*values):
        return "".join(f"{value:19.12E}" for value in values)

    zero, text = 0.0, f"{2.0:9.2f}{'':11}{'N: GPS NAV DATA':40}RINEX VERSION / TYPE\n{'':60}END OF HEADER\n"
    e = {name: values.tolist() for name, values in almanac.elements.items()}
    for k, number in enumerate(almanac.number.tolist()):
        week, second, _ = gpstime.week_second_ns(int(almanac.reference_ns[k]))
        m = gpstime.to_calendar(int(almanac.reference_ns[k]))
        health = 0 if almanac.healthy[k] else 63
        head = (
            f"{number:2d} {m.year % 100:02d} {m.month:2d} {m.day:2d} {m.hour:2d} {m.minute:2d}{m.second:5.1f}"
        )
        rows = (
            (1.0, zero, zero, e["m0"][k]), (zero, e["e"][k], zero, e["sqrt_a"][k]),
            (float(second), zero, e["omega0"][k], zero), (e["i0"][k], zero, e["omega"][k], e["omega_dot"][k]),
            (zero, 1.0, float(week), zero), (2.0, float(health), zero, 1.0), (float(second - 60), 4.0),
        )  # fmt: skip
        text += head + numbers(zero, zero, zero) + "\n"
        text += "".join("   " + numbers(*row) + "\n" for row in rows)
    path = folder / "april.nav"
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The satellites of the April almanac fly; receivers hold the one of 31 days before."""
    folder = tmp_path_factory.mktemp("almanac")
    flown, _ = yuma_and_sem()
    (folder / "old.toml").write_text(f"""name = "old-almanac"
[time]
start_gps = 2016-04-02T19:45:00
duration_s = 180
[sky]
gps = "{navigation(flown, folder)}"
glonass = "none"
almanac = ["{data_file("almanacs/current.al3")}"]
[[craft]]
name = "soyuz"
vehicle = "soyuz-ms.toml"
orbit = {{altitude_km = 415, inclination_deg = 51.6}}
""")
    out = folder / "run"
    arguments = ("--bus", "inline", "--quiet", "--no-report", "--out", str(out))
    assert main.main(["run", str(folder / "old.toml"), *arguments]) == 0
    return out


def test_an_almanac_of_a_month_ago_is_enough_to_assign_satellites(run):
    summary = json.loads((run / "summary.json").read_text())["craft"]["soyuz"]
    print(
        f"month-old almanac: {summary['assignment']}, {summary['fixes']} fixes, {summary['position_error_m']}"
    )
    assert summary["assignment"]["commands"] > 10
    assert summary["assignment"]["rejected"] == 0
    assert summary["satellites_tracked"]["max"] >= 8
    assert summary["fixes"] > 100


def test_frames_carry_the_old_almanac_and_its_age(run):
    """Decoded by cantools: what SEM says of the minute, 250 m steps; ten days is the oldest age there is."""
    yuma, sem = yuma_and_sem()
    index = satellites.index(satellites.GPS, yuma.number)
    held, flown = (orbits.hold(index, [part], int(part.reference_ns[0])) for part in (sem, yuma))
    start_ns = gpstime.from_calendar(datetime(2016, 4, 2, 19, 45))
    from_almanac_m, from_sky_m, seen = [], [], set()
    for epoch in buslog.read(run / "bus.log", DBC)[:20]:
        for name, row in epoch.almanac.items():
            place = np.flatnonzero(index == satellites.parse(name))
            t_ns = start_ns + epoch.number * 10**9
            sent = np.array([row["x_m"], row["y_m"], row["z_m"]])
            from_almanac_m.append(np.abs(sent - held.at(place, t_ns).pos_ecef_m[0]).max())
            from_sky_m.append(np.linalg.norm(sent - flown.at(place, t_ns).pos_ecef_m[0]))
            assert row["age_h"] == 255
            seen.add(name)
    assert len(seen) == len(index)
    assert max(from_almanac_m) <= 125.01
    print(f"month-old almanac from the sky: median {np.median(from_sky_m) / 1e3:.1f} km")
    assert 5e3 < np.median(from_sky_m) < 200e3


@pytest.mark.verifies(
    "emulator/receivers/emulated/almanac.py",
    what="Old almanacs in a run",
    by=(
        "satellites of April 2016 with the almanac of March: 46 km off (median), satellites without one "
        "tracked are assigned by it and found; frames read by cantools"
    ),
    status="validated",
)
def test_satellites_never_tracked_are_assigned_by_the_old_almanac(run):
    """Nothing else on the bus says where they are. G19 is not found, nor with an almanac without errors."""
    tracked, by_almanac = set(), set()
    for epoch in buslog.read(run / "bus.log", DBC):
        tracked |= {buslog.sat_name(row) for row in epoch.channels.values()}
        wanted = {buslog.sat_name(row) for _, row in epoch.commands if row["sat_number"]}
        by_almanac |= wanted - tracked
    print(f"assigned before anybody tracked them: {sorted(by_almanac)}")
    assert len(by_almanac & tracked) >= 6
    assert len(by_almanac - tracked) <= 1
